#include "knap/archive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/checksum.hpp"
#include "base/file.hpp"
#include "emit/draco_tile.hpp"
#include "emit/lattice.hpp"
#include "emit/tileset_check.hpp"
#include "knap/error.hpp"
#include "store/manifest.hpp"

namespace knap {

namespace fs = std::filesystem;

namespace {

template <typename Expected, typename Found>
void require_equal(const fs::path& file, std::string_view what, const Expected& expected,
                   const Found& found) {
    if (expected != found) {
        throw InputError(
            fmt::format("{}: {}: expected {}, found {}", file.string(), what, expected, found));
    }
}

std::string to_text(const Box& box) {
    return fmt::format("({}, {}, {}) .. ({}, {}, {})", box.min.x, box.min.y, box.min.z, box.max.x,
                       box.max.y, box.max.z);
}

/// The bytes of a tile, held against the manifest's size and checksum before anything reads them.
std::vector<std::byte> read_checked(const fs::path& file, const ManifestTile& tile) {
    const InputFile input(file);
    require_equal(file, "bytes", tile.bytes, input.size());
    std::vector<std::byte> bytes(input.size());
    bytes.resize(input.read_some(0, bytes));
    require_equal(file, "XXH3", tile.xxh3, fmt::format("{:016x}", xxh3_64(bytes)));
    return bytes;
}

/// What the tile says of itself, held against the manifest.
void check_tile(const fs::path& file, const ManifestTile& tile, const DecodedTile& decoded,
                const Manifest& manifest) {
    require_equal(file, "points", tile.points, decoded.points.size());
    const bool same_lattice = decoded.lattice.step == manifest.lattice.step &&
                              decoded.lattice.origin == manifest.lattice.origin &&
                              decoded.origin == tile.origin;
    if (!same_lattice) {
        throw InputError(fmt::format(
            "{}: expected the manifest's lattice and tile origin, found others", file.string()));
    }
}

/// The columns of a tile in the order of the manifest's attributes.
std::vector<std::vector<std::byte>> take_columns(DracoColumns found,
                                                 const std::vector<Attribute>& attributes,
                                                 const fs::path& file) {
    require_equal(file, "attributes", attributes.size(), found.attributes.size());
    std::vector<std::vector<std::byte>> columns;
    columns.reserve(attributes.size());
    for (const Attribute& attribute : attributes) {
        const auto place = std::find(found.attributes.begin(), found.attributes.end(), attribute);
        if (place == found.attributes.end()) {
            throw InputError(fmt::format(
                "{}: expected the manifest's attribute \"{}\", {} x {}, found none such",
                file.string(), attribute.name, attribute.components, to_string(attribute.type)));
        }
        columns.push_back(
            std::move(found.values[static_cast<std::size_t>(place - found.attributes.begin())]));
    }
    return columns;
}

void check_sums(const fs::path& file, const Manifest& manifest) {
    const Counts& counts = manifest.counts;
    std::uint64_t points = 0;
    std::uint64_t rejected = 0;
    for (const ManifestSource& source : manifest.sources) {
        points += source.points;
        rejected += source.rejected;
    }
    require_equal(file, "sources' points", counts.in, points);
    require_equal(file, "sources' rejected", counts.rejected, rejected);
    require_equal(file, "counts", counts.in,
                  counts.kept + counts.represented + counts.merged + counts.rejected);
}

void check_no_strays(const fs::path& folder, const Manifest& manifest,
                     const TilesetCheck& tileset) {
    std::set<std::string> named{std::string(kManifestName), std::string(kReportName)};
    named.insert(tileset.files.begin(), tileset.files.end());
    for (const ManifestTile& tile : manifest.tiles) {
        if (!named.insert(tile.file).second) {
            throw InputError(fmt::format("{}: tiles: expected each file once, found {} twice",
                                         (folder / kManifestName).string(), tile.file));
        }
    }
    std::error_code error;
    for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
        const bool is_folder = entry->is_directory(error);
        if (!is_folder && !named.contains(entry->path().lexically_relative(folder).string())) {
            throw InputError(fmt::format("{}: expected only files that the manifest names",
                                         entry->path().string()));
        }
    }
    if (error) {
        throw InputError(
            fmt::format("{}: cannot list the archive: {}", folder.string(), error.message()));
    }
}

}  // namespace

Archive::Archive(const fs::path& folder) : folder_(folder) {
    std::error_code ignored;
    if (!fs::is_directory(folder, ignored)) {
        throw InputError(
            fmt::format("{}: expected an archive folder, found none", folder.string()));
    }
    manifest_ = read_manifest(folder);
}

std::vector<Vec3> Archive::read_tile(std::size_t tile) const {
    return read_whole_tile(tile).positions;
}

Tile Archive::read_whole_tile(std::size_t tile) const {
    const ManifestTile& entry = manifest_.tiles.at(tile);
    const fs::path file = folder_ / entry.file;
    DecodedTile decoded = decode_tile(read_checked(file, entry), file);
    check_tile(file, entry, decoded, manifest_);
    Tile result;
    result.positions.reserve(decoded.points.size());
    for (const LatticeIndex& index : decoded.points) {
        result.positions.push_back(position_of(manifest_.lattice, index));
    }
    result.columns = take_columns(std::move(decoded.columns), manifest_.attributes, file);
    return result;
}

Verification Archive::verify() const {
    const fs::path manifest_file = folder_ / kManifestName;
    check_sums(manifest_file, manifest_);
    const TilesetCheck tileset = check_tileset(folder_, manifest_);
    check_no_strays(folder_, manifest_, tileset);
    Verification found;
    found.tileset_tiles = tileset.tiles;
    found.tileset_bytes = tileset.bytes;
    Box box;
    for (std::size_t i = 0; i < manifest_.tiles.size(); ++i) {
        const ManifestTile& tile = manifest_.tiles[i];
        Box tile_box;
        for (const Vec3& position : read_tile(i)) {
            tile_box.extend(position);
        }
        if (tile_box != tile.box) {
            throw InputError(fmt::format("{}: box: expected {}, found {}",
                                         (folder_ / tile.file).string(), to_text(tile.box),
                                         to_text(tile_box)));
        }
        box.extend(tile_box);
        ++found.tiles;
        found.points += tile.points;
        found.bytes += tile.bytes;
    }
    require_equal(manifest_file, "points of all tiles", manifest_.counts.kept, found.points);
    if (box != manifest_.box) {
        throw InputError(fmt::format("{}: box: expected {}, found {}", manifest_file.string(),
                                     to_text(manifest_.box), to_text(box)));
    }
    return found;
}

}  // namespace knap
