#include "input/archive_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "base/checksum.hpp"
#include "input/draco_reader.hpp"
#include "input/tiled_source.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "store/manifest.hpp"

namespace knap {

namespace {

namespace fs = std::filesystem;

/// The bytes of a tile, if they are those that the manifest names.
std::vector<std::byte> read_tile(const fs::path& file, const ManifestTile& tile) {
    const InputFile input(file);
    if (input.size() != tile.bytes) {
        throw InputError(fmt::format("{}: expected {} bytes as the manifest says, found {}",
                                     file.string(), tile.bytes, input.size()));
    }
    std::vector<std::byte> bytes(tile.bytes);
    bytes.resize(input.read_some(0, bytes));
    const std::string digest = fmt::format("{:016x}", xxh3_64(bytes));
    if (digest != tile.xxh3) {
        throw InputError(fmt::format("{}: expected the XXH3 {} as the manifest says, found {}",
                                     file.string(), tile.xxh3, digest));
    }
    return bytes;
}

/// The columns in the order of the manifest's attributes.
std::vector<std::vector<std::byte>> take_columns(DracoColumns found,
                                                 const std::vector<Attribute>& attributes,
                                                 const fs::path& file) {
    std::vector<std::vector<std::byte>> columns;
    columns.reserve(attributes.size());
    for (const Attribute& attribute : attributes) {
        const auto place = std::ranges::find(found.attributes, attribute);
        if (place == found.attributes.end()) {
            throw InputError(fmt::format("{}: expected the manifest's attribute '{}', found none",
                                         file.string(), attribute.name));
        }
        columns.push_back(
            std::move(found.values[static_cast<std::size_t>(place - found.attributes.begin())]));
    }
    return columns;
}

TileContent load_tile(const fs::path& folder, const Manifest& manifest, std::size_t number) {
    const ManifestTile& tile = manifest.tiles[number];
    const fs::path file = folder / tile.file;
    DracoCloud cloud = decode_draco(read_tile(file, tile), file);
    const Lattice& lattice = manifest.lattice;
    const bool agrees = cloud.lattice && cloud.lattice->origin == lattice.origin &&
                        cloud.lattice->step == lattice.step &&
                        cloud.lattice->tile_origin == tile.origin &&
                        cloud.positions.size() == tile.points;
    if (!agrees) {
        throw InputError(fmt::format(
            "{}: expected {} points on the manifest's lattice, found {} or another lattice",
            file.string(), tile.points, cloud.positions.size()));
    }
    TileContent content;
    content.positions.reserve(cloud.positions.size());
    for (const auto& index : lattice_indices(cloud, file)) {
        content.positions.push_back(lattice_position(lattice.origin, lattice.step, index));
    }
    content.columns = take_columns(std::move(cloud.columns), manifest.attributes, file);
    return content;
}

CoordinateFormat format_of(const Manifest& manifest) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    std::array<std::int64_t, 3> low{kMost, kMost, kMost};
    std::array<std::int64_t, 3> high{-kMost, -kMost, -kMost};
    const Lattice& lattice = manifest.lattice;
    for (const ManifestTile& tile : manifest.tiles) {
        for (int axis = 0; axis < 3; ++axis) {
            const auto i = static_cast<std::size_t>(axis);
            const double top = (tile.box.max[axis] - lattice.origin[axis]) / lattice.step;
            if (!(std::abs(top) < 0x1p53)) {
                return {};
            }
            low[i] = std::min(low[i], tile.origin[i]);
            high[i] = std::max(high[i], static_cast<std::int64_t>(std::llround(top)));
        }
    }
    return format_of_lattice(lattice.origin, lattice.step, low, high);
}

}  // namespace

std::unique_ptr<PointSource> open_archive(const InputFile& manifest_file) {
    const fs::path folder = manifest_file.path().parent_path();
    Manifest manifest = read_manifest(folder);
    SourceInfo info;
    info.path = manifest_file.path();
    info.format = fmt::format("knap archive {}", manifest.format_version);
    info.coordinates = format_of(manifest);
    info.schema = schema_of_tiles(
        info.coordinates.kind == CoordinateKind::kInt32 ? ScalarType::kInt32 : ScalarType::kFloat64,
        manifest.attributes);
    info.crs = manifest.crs;
    info.size_bytes = manifest_file.size();
    std::uint64_t count = 0;
    std::vector<std::uint64_t> tile_points;
    tile_points.reserve(manifest.tiles.size());
    for (const ManifestTile& tile : manifest.tiles) {
        tile_points.push_back(tile.points);
        count += tile.points;
        info.size_bytes += tile.bytes;
        info.seek_granularity = std::max(info.seek_granularity, tile.points);
    }
    // A granularity of 1 would say that points lie ready.
    info.seek_granularity = std::max<std::uint64_t>(info.seek_granularity, 2);
    info.declared_count = count;
    return open_tiles(std::move(info), tile_points,
                      [folder, manifest = std::move(manifest)](std::size_t tile) {
                          return load_tile(folder, manifest, tile);
                      });
}

}  // namespace knap
