#include "emit/archive_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/checksum.hpp"
#include "base/file.hpp"
#include "base/memory_gate.hpp"
#include "base/threads.hpp"
#include "emit/attribute_plan.hpp"
#include "knap/error.hpp"
#include "store/manifest.hpp"
#include "store/tileset_file.hpp"

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
      format_{manifest_.lattice, manifest_.crs, manifest_.attributes},
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
    const GetContent content = [&](const TileSpan& span) {
        return Content{{}, {}, {points.subspan(span.first, span.count), {}, span.bounds.min}};
    };
    write_tiles(plan, content, memory_bytes);
}

void ArchiveWriter::add(std::span<CarryingPoint> points, std::span<const std::byte> rows,
                        std::uint64_t memory_bytes) {
    const std::vector<TileSpan> plan = plan_tiles(points, output_.tile_points, output_.poll);
    const std::size_t row_size = row_layout(format_.attributes).row_size;
    const GetContent content = [&](const TileSpan& span) {
        const std::span<CarryingPoint> tile = points.subspan(span.first, span.count);
        std::sort(tile.begin(), tile.end(),
                  [](const CarryingPoint& a, const CarryingPoint& b) { return a.row < b.row; });
        Content held;
        held.points.reserve(tile.size());
        held.rows.reserve(tile.size() * row_size);
        for (const CarryingPoint& point : tile) {
            const auto row = rows.subspan(point.row * row_size, row_size);
            held.points.push_back(point.index);
            held.rows.insert(held.rows.end(), row.begin(), row.end());
        }
        held.tile = {held.points, held.rows, span.bounds.min};
        return held;
    };
    write_tiles(plan, content, memory_bytes);
}

void ArchiveWriter::write_tiles(std::span<const TileSpan> plan, const GetContent& content,
                                std::uint64_t memory_bytes) {
    const std::size_t first = manifest_.tiles.size();
    manifest_.tiles.resize(first + plan.size());
    MemoryGate gate(memory_bytes);
    if (!coding_ && !plan.empty()) {
        coding_ = choose_coding(plan.front(), content, gate);
    }
    run_tasks(plan.size(), output_.threads, [&](std::size_t i) {
        output_.poll();
        const auto ticket = gate.admit(encode_memory_bytes(plan[i].count, format_.attributes));
        manifest_.tiles[first + i] = tile(first + i, plan[i], content);
        if (output_.tiles.on_tile) {
            const std::scoped_lock lock(mutex_);
            output_.tiles.on_tile(first + i, manifest_.tiles[first + i]);
        }
    });
}

ManifestTile ArchiveWriter::tile(std::size_t number, const TileSpan& span,
                                 const GetContent& content) const {
    const auto done = output_.tiles.done.find(number);
    const bool is_done = done != output_.tiles.done.end() &&
                         is_whole(folder_.path() / done->second.file, done->second);
    return is_done ? done->second : write_tile(number, span, content);
}

ManifestTile ArchiveWriter::write_tile(std::size_t number, const TileSpan& span,
                                       const GetContent& content) const {
    const Content points = content(span);
    const std::vector<std::byte> bytes = encode_tile(points.tile, format_, *coding_);
    ManifestTile tile;
    tile.file = tile_name(number);
    tile.points = span.count;
    tile.box.extend(position_of(manifest_.lattice, span.bounds.min));
    tile.box.extend(position_of(manifest_.lattice, span.bounds.max));
    tile.origin = span.bounds.min;
    tile.bytes = bytes.size();
    tile.xxh3 = digest_of(bytes);
    AtomicFile file(folder_.path() / tile.file);
    file.write(bytes);
    file.commit();
    return tile;
}

// By the first tile, which is the same in every run of a job.
TileCoding ArchiveWriter::choose_coding(const TileSpan& first, const GetContent& content,
                                        MemoryGate& gate) const {
    const Content points = content(first);
    const std::vector<TileCoding> ways = codings(output_.encoding, format_.attributes);
    if (ways.size() == 1) {
        return ways.front();
    }
    std::vector<std::size_t> bytes(ways.size());
    run_tasks(ways.size(), output_.threads, [&](std::size_t i) {
        const auto ticket = gate.admit(encode_memory_bytes(first.count, format_.attributes));
        bytes[i] = encoded_size(points.tile, format_, ways[i]);
    });
    const auto smallest = std::min_element(bytes.begin(), bytes.end()) - bytes.begin();
    return ways[static_cast<std::size_t>(smallest)];
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
    for (const std::string_view ending : {"", ".partial", ".old"}) {
        std::filesystem::remove_all(folder_.path() / fmt::format("{}{}", kTilesetFolder, ending),
                                    error);
    }
    if (output_.on_whole) {
        output_.on_whole(folder_.path(), manifest_.tiles.size(), bytes);
    }
    folder_.commit(output_.overwrite);
    return bytes;
}

}  // namespace knap
