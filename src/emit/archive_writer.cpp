#include "emit/archive_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <system_error>
#include <vector>

#include "base/checksum.hpp"
#include "base/file.hpp"
#include "base/memory_gate.hpp"
#include "base/threads.hpp"
#include "emit/draco_tile.hpp"
#include "emit/output_folder.hpp"
#include "emit/tiles.hpp"
#include "knap/error.hpp"
#include "store/manifest.hpp"

namespace knap {

namespace {

ManifestTile write_tile(const std::filesystem::path& folder, std::size_t number,
                        std::span<const LatticeIndex> points, const LatticeBounds& bounds,
                        const Manifest& manifest) {
    const std::vector<std::byte> bytes =
        encode_tile(points, bounds.min, manifest.lattice, manifest.crs);
    ManifestTile tile;
    tile.file = fmt::format("tiles/{:06}.drc", number);
    tile.points = points.size();
    tile.box.extend(position_of(manifest.lattice, bounds.min));
    tile.box.extend(position_of(manifest.lattice, bounds.max));
    tile.origin = bounds.min;
    tile.bytes = bytes.size();
    tile.xxh3 = fmt::format("{:016x}", xxh3_64(bytes));
    AtomicFile file(folder / tile.file);
    file.write(bytes);
    file.commit();
    return tile;
}

}  // namespace

std::uint64_t write_archive(std::span<LatticeIndex> points, Manifest& manifest,
                            const ArchiveOutput& output) {
    const std::vector<TileSpan> plan = plan_tiles(points, output.tile_points);
    OutputFolder folder(output.folder);
    std::error_code error;
    std::filesystem::create_directory(folder.path() / "tiles", error);
    if (error) {
        throw StorageError(fmt::format("{}: cannot create: {}", (folder.path() / "tiles").string(),
                                       error.message()));
    }

    manifest.tiles.assign(plan.size(), {});
    MemoryGate gate(output.memory_bytes);
    run_tasks(plan.size(), output.threads, [&](std::size_t i) {
        const auto ticket = gate.admit(encode_memory_bytes(plan[i].count));
        manifest.tiles[i] =
            write_tile(folder.path(), i, points.subspan(plan[i].first, plan[i].count),
                       plan[i].bounds, manifest);
    });

    std::uint64_t bytes = 0;
    manifest.box = {};
    for (const ManifestTile& tile : manifest.tiles) {
        bytes += tile.bytes;
        manifest.box.extend(tile.box);
    }
    write_manifest(folder.path(), manifest);
    bytes += std::filesystem::file_size(folder.path() / kManifestName, error);
    folder.commit(output.overwrite);
    return bytes;
}

}  // namespace knap
