#include "emit/decode.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
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
        for (std::size_t i = 0; i < archive->manifest().tiles.size(); ++i) {
            take(archive->read_tile(i), {});
        }
    };
    return cloud;
}

Cloud draco_cloud(const fs::path& file) {
    const DracoCloud draco = read_draco(file);
    auto positions = std::make_shared<std::vector<Vec3>>();
    positions->reserve(draco.positions.size());
    Cloud cloud;
    cloud.content.step = 1;
    CloudOrigin origin{file.string(), {}, "", std::nullopt};
    if (draco.lattice) {
        const DecodedTile tile = on_lattice(draco, file);
        for (const LatticeIndex& index : tile.points) {
            positions->push_back(position_of(tile.lattice, index));
        }
        cloud.content.step = tile.lattice.step;
        origin.coordinates = grid_of(tile.lattice);
        origin.crs = draco.lattice->crs;
    } else {
        for (const std::array<float, 3>& position : draco.positions) {
            positions->push_back({position[0], position[1], position[2]});
        }
    }
    for (const Vec3& position : *positions) {
        cloud.content.box.extend(position);
    }
    if (!draco.lattice && cloud.content.box.diagonal() > 0) {
        // As fine as floats are at the far end of the box.
        cloud.content.step = std::exp2(std::ilogb(cloud.content.box.diagonal()) - 23);
    }
    cloud.origins.push_back(std::move(origin));
    cloud.content.points = positions->size();
    cloud.for_each = [positions](const TakePoints& take) { take(*positions, {}); };
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
