#include "input/recognise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "input/gzip.hpp"
#include "input/number.hpp"
#include "input/ptx_source.hpp"
#include "input/text_layout.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

using std::string_view_literals::operator""sv;  // NOLINT(misc-unused-using-decls): not seen

struct Foreign {
    std::string_view sign;  // first bytes, or ending with its dot
    std::string_view found;
};
constexpr std::array kForeignStarts{
    Foreign{"PK\x03\x04"sv, "a zip file: decompress it first"},
    Foreign{"BZh"sv, "a bzip2 file: decompress it first"},
    Foreign{"\xfd"
            "7zXZ"sv,
            "an xz file: decompress it first"},
    Foreign{"\x28\xb5\x2f\xfd"sv, "a zstd file: decompress it first"},
    Foreign{"ASTM-E57"sv, "an E57 file: convert it to LAZ or PLY first"},
    Foreign{"\x89HDF"sv, "an HDF5 file: convert it to LAZ or PLY first"},
    Foreign{"version https://git-lfs"sv, "a Git LFS pointer: fetch the file itself first"},
};
constexpr std::array kForeignEndings{
    Foreign{".e57"sv, "an E57 file: convert it to LAZ or PLY first"},
};
constexpr std::array kPointEndings{".xyz"sv, ".pts"sv, ".asc"sv};
constexpr std::array kTableEndings{".txt"sv, ".csv"sv, ".tsv"sv};

std::string ending_of(const std::filesystem::path& path) {
    std::string ending = path.extension().string();
    std::ranges::transform(ending, ending.begin(), [](char c) {
        return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    return ending;
}

bool is_text(std::string_view head) {
    return std::ranges::none_of(head, [](char c) {
        const auto byte = static_cast<unsigned char>(c);
        return byte < 0x20 && c != '\t' && c != '\n' && c != '\r' && c != '\f' && c != '\v';
    });
}

Recognition refuse(std::string_view found) {
    return {
        .format = std::nullopt, .gzipped = false, .certain = false, .found = std::string(found)};
}

Recognition recognise_text(const InputFile& file, std::string_view head, std::string_view ending) {
    const bool is_cloud = std::ranges::find(kPointEndings, ending) != kPointEndings.end();
    const bool is_table = std::ranges::find(kTableEndings, ending) != kTableEndings.end();
    if (!is_text(head)) {
        return refuse(
            is_cloud || is_table
                ? fmt::format("binary data in a text file ({})", excerpt(head.substr(0, 8)))
                : fmt::format("an unknown format that begins with {}", excerpt(head.substr(0, 8))));
    }
    if (ending == ".ptx" || looks_like_ptx(file)) {
        return {.format = FileFormat::kPtx, .gzipped = false, .certain = true, .found = {}};
    }
    const bool certain = is_cloud || looks_like_points(file);
    if (certain || is_table) {
        return {.format = FileFormat::kText, .gzipped = false, .certain = certain, .found = {}};
    }
    return refuse(fmt::format("text that begins with {}",
                              excerpt(head.substr(0, head.find_first_of("\r\n")))));
}

/// What the file is, or what it decodes to.
Recognition recognise_content(const InputFile& file, const std::string& ending) {
    std::array<char, 4096> bytes{};
    const std::string_view head(bytes.data(),
                                file.read_some(0, std::as_writable_bytes(std::span(bytes))));
    if (head.starts_with("ply") && head.size() > 3 && is_text(head.substr(0, 4)) &&
        (head[3] <= ' ')) {
        return {.format = FileFormat::kPly, .gzipped = false, .certain = true, .found = {}};
    }
    if (head.starts_with("LASF")) {
        return {.format = FileFormat::kLas, .gzipped = false, .certain = true, .found = {}};
    }
    for (const Foreign& foreign : kForeignStarts) {
        if (head.starts_with(foreign.sign)) {
            return refuse(foreign.found);
        }
    }
    if (head.starts_with("DRACO") || ending == ".drc") {
        return {.format = FileFormat::kDraco, .gzipped = false, .certain = true, .found = {}};
    }
    if (head.starts_with("{") && head.find("\"knap archive\"") != std::string_view::npos) {
        return {.format = FileFormat::kArchive, .gzipped = false, .certain = true, .found = {}};
    }
    if (head.starts_with("# .PCD") || ending == ".pcd") {
        return {.format = FileFormat::kPcd, .gzipped = false, .certain = true, .found = {}};
    }
    if (ending == ".ply") {
        return {.format = FileFormat::kPly, .gzipped = false, .certain = true, .found = {}};
    }
    if (ending == ".las" || ending == ".laz") {
        return {.format = FileFormat::kLas, .gzipped = false, .certain = true, .found = {}};
    }
    for (const Foreign& foreign : kForeignEndings) {
        if (ending == foreign.sign) {
            return refuse(foreign.found);
        }
    }
    return recognise_text(file, head, ending);
}

Recognition recognise_gzip(const std::filesystem::path& path) {
    try {
        const InputFile decoded = gunzip(InputFile(path));
        Recognition recognition = recognise_content(decoded, ending_of(path.stem()));
        if (recognition.format == FileFormat::kPly || recognition.format == FileFormat::kPtx ||
            recognition.format == FileFormat::kText) {
            recognition.gzipped = true;
            return recognition;
        }
        return refuse(recognition.format ? "a gzip file that holds neither PLY nor text: "
                                           "decompress it first"
                                         : fmt::format("a gzip file of {}", recognition.found));
    } catch (const InputError&) {
        return refuse("a damaged gzip file");
    }
}

}  // namespace

Recognition recognise(const InputFile& file) {
    return is_gzip(file) ? recognise_gzip(file.path())
                         : recognise_content(file, ending_of(file.path()));
}

}  // namespace knap
