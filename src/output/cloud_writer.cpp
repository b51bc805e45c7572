#include "output/cloud_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>

#include "knap/error.hpp"
#include "output/las_fields.hpp"
#include "output/las_writer.hpp"
#include "output/ply_writer.hpp"
#include "output/xyz_writer.hpp"

namespace knap {

std::optional<CloudFormat> cloud_format_of(const std::filesystem::path& path) {
    std::string ending = path.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (ending == ".ply") {
        return CloudFormat::kPly;
    }
    if (ending == ".las") {
        return CloudFormat::kLas;
    }
    if (ending == ".laz") {
        return CloudFormat::kLaz;
    }
    if (ending == ".xyz") {
        return CloudFormat::kXyz;
    }
    return std::nullopt;
}

std::size_t row_size(std::span<const Attribute> attributes) {
    std::size_t bytes = 0;
    for (const Attribute& attribute : attributes) {
        bytes += attribute.value_size();
    }
    return bytes;
}

CloudWriter::CloudWriter(std::filesystem::path path, std::uint64_t points,
                         std::span<const Attribute> attributes)
    : path_(std::move(path)), file_(path_), announced_(points), row_bytes_(row_size(attributes)) {}

void CloudWriter::append(std::span<const Vec3> positions, std::span<const std::byte> rows) {
    if (rows.size() != positions.size() * row_bytes_) {
        throw StorageError(fmt::format(
            "{}: expected {} bytes of attributes for {} points, found "
            "{}",
            path_.string(), positions.size() * row_bytes_, positions.size(), rows.size()));
    }
    put(positions, rows);
    appended_ += positions.size();
}

std::uint64_t CloudWriter::complete() {
    if (appended_ != announced_) {
        throw StorageError(fmt::format("{}: expected {} points to write, found {}", path_.string(),
                                       announced_, appended_));
    }
    put_end();
    return file_.size();
}

void CloudWriter::commit() {
    file_.commit();
}

std::uint64_t CloudWriter::finish() {
    const std::uint64_t size = complete();
    commit();
    return size;
}

void CloudWriter::fail_at(std::size_t point, const std::string& attribute,
                          const std::string& expected, const std::string& found) const {
    throw InputError(fmt::format("{}: point {}: {}: expected {}, found {}", path_.string(),
                                 appended_ + point, attribute, expected, found));
}

std::unique_ptr<CloudWriter> open_cloud_writer(const std::filesystem::path& path,
                                               const CloudHeader& header) {
    switch (cloud_format_of(path).value_or(CloudFormat::kPly)) {
        case CloudFormat::kLas:
            return open_las_writer(path, header, false);
        case CloudFormat::kLaz:
            return open_las_writer(path, header, true);
        case CloudFormat::kXyz:
            return std::make_unique<XyzWriter>(path, header.points, header.attributes);
        case CloudFormat::kPly:
            break;
    }
    return std::make_unique<PlyWriter>(path, header);
}

std::vector<std::string> notes_on(CloudFormat format, const CloudHeader& header) {
    const bool is_las = format == CloudFormat::kLas || format == CloudFormat::kLaz;
    return is_las ? LasFields(header).notes() : std::vector<std::string>{};
}

}  // namespace knap
