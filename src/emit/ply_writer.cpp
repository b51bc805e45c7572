#include "emit/ply_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>

#include "knap/error.hpp"

namespace knap {

namespace {

static_assert(std::endian::native == std::endian::little, "values are written as they are held");

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;

template <typename T>
void put(std::vector<std::byte>& buffer, const Vec3& position) {
    const std::array<T, 3> values{static_cast<T>(position.x), static_cast<T>(position.y),
                                  static_cast<T>(position.z)};
    const auto bytes = std::as_bytes(std::span(values));
    buffer.insert(buffer.end(), bytes.begin(), bytes.end());
}

// A line break within would end the comment and corrupt the header.
std::string one_line(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
    return text;
}

}  // namespace

PlyWriter::PlyWriter(const std::filesystem::path& path, std::uint64_t points, Precision precision,
                     const std::vector<std::string>& comments)
    : path_(path), file_(path), precision_(precision), announced_(points) {
    std::string header = "ply\nformat binary_little_endian 1.0\n";
    for (const std::string& comment : comments) {
        header += fmt::format("comment {}\n", one_line(comment));
    }
    const std::string_view type = precision == Precision::kFloat ? "float" : "double";
    header +=
        fmt::format("element vertex {}\nproperty {} x\nproperty {} y\nproperty {} z\nend_header\n",
                    points, type, type, type);
    file_.write(header);
    buffer_.reserve(kBufferBytes + 3 * sizeof(double));
}

void PlyWriter::append(std::span<const Vec3> positions) {
    for (const Vec3& position : positions) {
        if (precision_ == Precision::kFloat) {
            put<float>(buffer_, position);
        } else {
            put<double>(buffer_, position);
        }
        if (buffer_.size() >= kBufferBytes) {
            flush();
        }
    }
    appended_ += positions.size();
}

std::uint64_t PlyWriter::finish() {
    if (appended_ != announced_) {
        throw StorageError(fmt::format("{}: expected {} points to write, found {}", path_.string(),
                                       announced_, appended_));
    }
    flush();
    file_.commit();
    return file_.size();
}

void PlyWriter::flush() {
    file_.write(buffer_);
    buffer_.clear();
}

}  // namespace knap
