#include "input/recognise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "input/number.hpp"
#include "input/text_layout.hpp"

namespace knap {

namespace {

using std::string_view_literals::operator""sv;  // NOLINT(misc-unused-using-decls): not seen

struct Foreign {
    std::string_view sign;  // first bytes, or ending with its dot
    std::string_view found;
};
constexpr std::array kForeignStarts{
    Foreign{"\x1f\x8b"sv, "a gzip file: decompress it first"},
    Foreign{"PK\x03\x04"sv, "a zip file: decompress it first"},
    Foreign{"BZh"sv, "a bzip2 file: decompress it first"},
    Foreign{"\xfd"
            "7zXZ"sv,
            "an xz file: decompress it first"},
    Foreign{"\x28\xb5\x2f\xfd"sv, "a zstd file: decompress it first"},
    Foreign{"ASTM-E57"sv, "an E57 file: convert it to LAZ or PLY first"},
    Foreign{"DRACO"sv, "a Draco file: decode it to PLY first"},
    Foreign{"\x89HDF"sv, "an HDF5 file: convert it to LAZ or PLY first"},
    Foreign{"version https://git-lfs"sv, "a Git LFS pointer: fetch the file itself first"},
};
constexpr std::array kForeignEndings{
    Foreign{".ptx"sv, "a PTX file: convert it to PLY first"},
    Foreign{".e57"sv, "an E57 file: convert it to LAZ or PLY first"},
    Foreign{".drc"sv, "a Draco file: decode it to PLY first"},
};
constexpr std::array kPointEndings{".xyz"sv, ".pts"sv, ".asc"sv};
constexpr std::array kTableEndings{".txt"sv, ".csv"sv, ".tsv"sv};

std::string ending_of(const InputFile& file) {
    std::string ending = file.path().extension().string();
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
    return {.format = std::nullopt, .certain = false, .found = std::string(found)};
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
    const bool certain = is_cloud || looks_like_points(file);
    if (certain || is_table) {
        return {.format = FileFormat::kText, .certain = certain, .found = {}};
    }
    return refuse(fmt::format("text that begins with {}",
                              excerpt(head.substr(0, head.find_first_of("\r\n")))));
}

}  // namespace

Recognition recognise(const InputFile& file) {
    std::array<char, 4096> bytes{};
    const std::string_view head(bytes.data(),
                                file.read_some(0, std::as_writable_bytes(std::span(bytes))));
    const std::string ending = ending_of(file);
    if (head.starts_with("ply") && head.size() > 3 && is_text(head.substr(0, 4)) &&
        (head[3] <= ' ')) {
        return {.format = FileFormat::kPly, .certain = true, .found = {}};
    }
    if (head.starts_with("LASF")) {
        return {.format = FileFormat::kLas, .certain = true, .found = {}};
    }
    for (const Foreign& foreign : kForeignStarts) {
        if (head.starts_with(foreign.sign)) {
            return refuse(foreign.found);
        }
    }
    if (head.starts_with("# .PCD") || ending == ".pcd") {
        return {.format = FileFormat::kPcd, .certain = true, .found = {}};
    }
    if (ending == ".ply") {
        return {.format = FileFormat::kPly, .certain = true, .found = {}};
    }
    if (ending == ".las" || ending == ".laz") {
        return {.format = FileFormat::kLas, .certain = true, .found = {}};
    }
    for (const Foreign& foreign : kForeignEndings) {
        if (ending == foreign.sign) {
            return refuse(foreign.found);
        }
    }
    return recognise_text(file, head, ending);
}

}  // namespace knap
