#include "emit/archive_writer.hpp"

#include <fmt/format.h>

#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/checksum.hpp"
#include "base/file.hpp"
#include "base/memory_gate.hpp"
#include "base/threads.hpp"
#include "emit/draco_tile.hpp"
#include "knap/error.hpp"
#include "store/manifest.hpp"

namespace knap {

namespace {

std::string tile_name(std::size_t number) {
    return fmt::format("tiles/{:06}.drc", number);
}

std::string digest_of(std::span<const std::byte> bytes) {
    return fmt::format("{:016x}", xxh3_64(bytes));
}

bool is_whole(const std::filesystem::path& file, const ManifestTile& tile) {
    try {
        const InputFile input(file);
        std::vector<std::byte> bytes(tile.bytes);
        return input.size() == tile.bytes && input.read_some(0, bytes) == bytes.size() &&
               digest_of(bytes) == tile.xxh3;
    } catch (const InputError&) {
        return false;
    }
}

}  // namespace

ArchiveWriter::ArchiveWriter(Manifest manifest, ArchiveOutput output)
    : manifest_(std::move(manifest)),
      output_(std::move(output)),
      folder_(output_.folder, output_.tiles.on_tile ? OutputFolder::Unfinished::kStays
                                                    : OutputFolder::Unfinished::kGoes) {
    if (output_.tiles.done.empty()) {
        folder_.clear();
    }
    std::error_code error;
    std::filesystem::create_directory(folder_.path() / "tiles", error);
    if (error) {
        throw StorageError(fmt::format("{}: cannot create: {}", (folder_.path() / "tiles").string(),
                                       error.message()));
    }
}

void ArchiveWriter::add(std::span<LatticeIndex> points, std::uint64_t memory_bytes) {
    const std::vector<TileSpan> plan = plan_tiles(points, output_.tile_points, output_.poll);
    const std::size_t first = manifest_.tiles.size();
    manifest_.tiles.resize(first + plan.size());
    MemoryGate gate(memory_bytes);
    run_tasks(plan.size(), output_.threads, [&](std::size_t i) {
        output_.poll();
        const auto ticket = gate.admit(encode_memory_bytes(plan[i].count));
        manifest_.tiles[first + i] =
            tile(first + i, points.subspan(plan[i].first, plan[i].count), plan[i].bounds);
        if (output_.tiles.on_tile) {
            const std::scoped_lock lock(mutex_);
            output_.tiles.on_tile(first + i, manifest_.tiles[first + i]);
        }
    });
}

ManifestTile ArchiveWriter::tile(std::size_t number, std::span<const LatticeIndex> points,
                                 const LatticeBounds& bounds) const {
    const auto done = output_.tiles.done.find(number);
    const bool is_done = done != output_.tiles.done.end() &&
                         is_whole(folder_.path() / done->second.file, done->second);
    return is_done ? done->second : write_tile(number, points, bounds);
}

ManifestTile ArchiveWriter::write_tile(std::size_t number, std::span<const LatticeIndex> points,
                                       const LatticeBounds& bounds) const {
    const std::vector<std::byte> bytes =
        encode_tile(points, bounds.min, manifest_.lattice, manifest_.crs);
    ManifestTile tile;
    tile.file = tile_name(number);
    tile.points = points.size();
    tile.box.extend(position_of(manifest_.lattice, bounds.min));
    tile.box.extend(position_of(manifest_.lattice, bounds.max));
    tile.origin = bounds.min;
    tile.bytes = bytes.size();
    tile.xxh3 = digest_of(bytes);
    AtomicFile file(folder_.path() / tile.file);
    file.write(bytes);
    file.commit();
    return tile;
}

std::uint64_t ArchiveWriter::finish() {
    std::uint64_t bytes = 0;
    manifest_.box = {};
    for (const ManifestTile& tile : manifest_.tiles) {
        bytes += tile.bytes;
        manifest_.box.extend(tile.box);
    }
    write_manifest(folder_.path(), manifest_);
    std::error_code error;
    bytes += std::filesystem::file_size(folder_.path() / kManifestName, error);
    // An earlier run of the job may have been stopped just here.
    std::filesystem::remove(folder_.path() / kReportName, error);
    if (output_.on_whole) {
        output_.on_whole(folder_.path(), manifest_.tiles.size(), bytes);
    }
    folder_.commit(output_.overwrite);
    return bytes;
}

}  // namespace knap
