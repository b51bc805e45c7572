#include "emit/decode.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "emit/cloud_header.hpp"
#include "emit/draco_tile.hpp"
#include "emit/lattice.hpp"
#include "input/draco_reader.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "output/cloud_writer.hpp"

namespace knap {

namespace fs = std::filesystem;

namespace {

/// Takes some points, and their rows of attributes.
using TakePoints =
    std::function<void(std::span<const Vec3> positions, std::span<const std::byte> rows)>;

/// A cloud that can be read once, from its first point to its last.
struct Cloud {
    std::vector<CloudOrigin> origins;
    CloudContent content;
    std::function<void(const TakePoints& take)> for_each;
};

/// Columns as rows.
std::vector<std::byte> rows_of(std::size_t points, std::span<const Attribute> attributes,
                               std::span<const std::vector<std::byte>> columns) {
    const std::size_t row = row_size(attributes);
    std::vector<std::byte> rows(points * row);
    std::size_t offset = 0;
    for (std::size_t c = 0; c < columns.size(); ++c) {
        const std::size_t size = attributes[c].value_size();
        for (std::size_t i = 0; i < points; ++i) {
            std::memcpy(rows.data() + i * row + offset, columns[c].data() + i * size, size);
        }
        offset += size;
    }
    return rows;
}

CoordinateFormat grid_of(const Lattice& lattice) {
    return {CoordinateKind::kInt32, {lattice.step, lattice.step, lattice.step}, lattice.origin};
}

/// The grid that all points of an archive lie on: that of its sources, if they have the same one
/// and it is no finer than the lattice; else the lattice itself.
CoordinateFormat grid_of(const Manifest& manifest) {
    constexpr double kTolerance = 1e-9;
    const CoordinateFormat& first = manifest.sources.front().coordinates;
    bool same = first.kind == CoordinateKind::kInt32;
    for (const ManifestSource& source : manifest.sources) {
        same = same && source.coordinates == first;
    }
    for (int axis = 0; axis < 3; ++axis) {
        const double ratio = first.scale[axis] / manifest.lattice.step;
        same = same && ratio > 0.5 && std::abs(ratio - std::round(ratio)) <= kTolerance * ratio;
    }
    return same ? first : grid_of(manifest.lattice);
}

Cloud archive_cloud(const fs::path& folder) {
    const auto archive = std::make_shared<const Archive>(folder);
    const Manifest& manifest = archive->manifest();
    Cloud cloud;
    for (const ManifestTile& tile : manifest.tiles) {
        cloud.content.points += tile.points;
    }
    cloud.content.attributes = manifest.attributes;
    cloud.content.box = manifest.box;
    cloud.content.step = manifest.lattice.step;
    const CoordinateFormat grid =
        manifest.sources.empty() ? grid_of(manifest.lattice) : grid_of(manifest);
    for (const ManifestSource& source : manifest.sources) {
        cloud.origins.push_back({source.path, grid, source.crs, source.las});
    }
    if (cloud.origins.empty()) {
        cloud.origins.push_back({folder.string(), grid, manifest.crs, std::nullopt});
    }
    cloud.for_each = [archive](const TakePoints& take) {
        const Manifest& of = archive->manifest();
        for (std::size_t i = 0; i < of.tiles.size(); ++i) {
            const Tile tile = archive->read_whole_tile(i);
            take(tile.positions, rows_of(tile.positions.size(), of.attributes, tile.columns));
        }
    };
    return cloud;
}

Cloud draco_cloud(const fs::path& file) {
    DracoCloud draco = read_draco(file);
    auto positions = std::make_shared<std::vector<Vec3>>();
    positions->reserve(draco.positions.size());
    DracoColumns columns;
    Cloud cloud;
    cloud.content.step = 1;
    CloudOrigin origin{file.string(), {}, "", std::nullopt};
    if (draco.lattice) {
        DecodedTile tile = on_lattice(std::move(draco), file);
        for (const LatticeIndex& index : tile.points) {
            positions->push_back(position_of(tile.lattice, index));
        }
        cloud.content.step = tile.lattice.step;
        origin.coordinates = grid_of(tile.lattice);
        origin.crs = tile.crs;
        columns = std::move(tile.columns);
    } else {
        *positions = std::move(draco.positions);
        origin.coordinates.kind = draco.kind;
        columns = std::move(draco.columns);
    }
    for (const Vec3& position : *positions) {
        cloud.content.box.extend(position);
    }
    if (origin.coordinates.kind != CoordinateKind::kInt32 && cloud.content.box.diagonal() > 0) {
        // As fine as floats are at the far end of the box.
        cloud.content.step = std::exp2(std::ilogb(cloud.content.box.diagonal()) - 23);
    }
    cloud.origins.push_back(std::move(origin));
    cloud.content.points = positions->size();
    cloud.content.attributes = columns.attributes;
    auto rows = std::make_shared<std::vector<std::byte>>(
        rows_of(positions->size(), columns.attributes, columns.values));
    cloud.for_each = [positions, rows](const TakePoints& take) { take(*positions, *rows); };
    return cloud;
}

}  // namespace

DecodeResult decode(const fs::path& input, const fs::path& output, bool overwrite) {
    const std::optional<CloudFormat> format = cloud_format_of(output);
    if (!format) {
        throw ConfigError(
            fmt::format("{}: expected an output ending in .ply, .las, .laz or .xyz, found \"{}\"",
                        output.string(), output.extension().string()));
    }
    std::error_code error;
    if (fs::is_directory(output, error)) {
        throw ConfigError(fmt::format("{}: expected a file, found a folder", output.string()));
    }
    if (fs::exists(fs::symlink_status(output, error)) && !overwrite) {
        throw ConfigError(fmt::format("{}: exists (needs --overwrite)", output.string()));
    }
    Cloud cloud = fs::is_directory(input, error) ? archive_cloud(input) : draco_cloud(input);
    cloud.content.as_stored = false;
    const HeaderWithNotes made = make_cloud_header(*format, cloud.origins, cloud.content);
    const std::unique_ptr<CloudWriter> writer = open_cloud_writer(output, made.header);
    cloud.for_each([&](std::span<const Vec3> positions, std::span<const std::byte> rows) {
        writer->append(positions, rows);
    });
    return {cloud.content.points, writer->finish(), made.notes};
}

}  // namespace knap
