#include "emit/tileset_check.hpp"

#include <fmt/format.h>

#include <optional>
#include <string_view>

#include "base/checksum.hpp"
#include "base/file.hpp"
#include "knap/error.hpp"
#include "store/manifest.hpp"
#include "store/tileset_file.hpp"

namespace knap {

namespace fs = std::filesystem;

namespace {

template <typename Value>
void require_equal(const fs::path& file, std::string_view what, const Value& expected,
                   const Value& found) {
    if (expected != found) {
        throw InputError(
            fmt::format("{}: {}: expected {}, found {}", file.string(), what, expected, found));
    }
}

}  // namespace

TilesetCheck check_tileset(const fs::path& archive, const Manifest& manifest) {
    const fs::path folder = archive / kTilesetFolder;
    TilesetCheck check;
    const std::optional<TilesetIndex> found = find_tileset(archive);
    if (!found) {
        return check;
    }
    const TilesetIndex& index = *found;
    const fs::path name(kTilesetFolder);
    check.files.push_back((name / kTilesetName).string());
    require_equal(folder / kTilesetName, "the archive's XXH3",
                  xxh3_64_of_file(archive / kManifestName), index.archive);
    std::uint64_t points = 0;
    for (const TilesetContent& content : index.contents) {
        const fs::path file = folder / content.file;
        require_equal(file, "bytes", content.bytes, InputFile(file).size());
        require_equal(file, "XXH3", content.xxh3, xxh3_64_of_file(file));
        check.files.push_back((name / content.file).string());
        points += content.points;
        ++check.tiles;
        check.bytes += content.bytes;
    }
    require_equal(folder / kTilesetName, "points of all tiles", manifest.counts.kept, points);
    require_equal(folder / kTilesetName, "points", index.points, points);
    return check;
}

}  // namespace knap
