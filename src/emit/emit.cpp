#include "emit/emit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>

#include "base/file.hpp"
#include "emit/archive_writer.hpp"
#include "emit/draco_tile.hpp"
#include "emit/kept_file.hpp"
#include "emit/kept_points.hpp"
#include "emit/lattice.hpp"
#include "emit/output_check.hpp"
#include "emit/single_file.hpp"
#include "emit/tiles.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "store/manifest.hpp"

namespace knap {

namespace {

constexpr const char* kKeptFile = "kept-";

void check_memory(std::uint64_t kept, const EmitRequest& request) {
    const std::uint64_t needed = emit_memory_bytes(kept, request.output);
    if (needed > request.memory_bytes) {
        throw StorageError(fmt::format(
            "{}: {} kept points need {} of memory to be written, expected at most {} "
            "(resources.memory)",
            request.output.path, kept, format_bytes(needed), format_bytes(request.memory_bytes)));
    }
}

/// The kept points on the lattice, in any order.
std::vector<LatticeIndex> read_indices(const KeptPoints& kept, const Lattice& lattice,
                                       const EmitRequest& request) {
    std::vector<LatticeIndex> indices(kept.selection.count());
    TakeKept put = [&](const KeptBlock& block) {
        for (std::size_t i = 0; i < block.positions.size(); ++i) {
            indices[block.place + i] = index_of(lattice, block.positions[i]);
        }
    };
    read_kept(
        kept, request.threads, [&] { return put; }, request.advance);
    return indices;
}

std::string common_crs(const SourceTable& sources) {
    std::string crs = sources.sources().empty() ? "" : sources.sources().front().info.crs;
    for (const SourceEntry& source : sources.sources()) {
        if (source.info.crs != crs) {
            return "";
        }
    }
    return crs;
}

std::vector<ManifestSource> manifest_sources(const SourceTable& sources) {
    std::vector<ManifestSource> result;
    for (const SourceEntry& source : sources.sources()) {
        result.push_back({.path = source.given_path,
                          .format = source.info.format,
                          .points = source.points,
                          .rejected = source.rejected,
                          .bytes = source.info.size_bytes,
                          .xxh3 = source.xxh3,
                          .coordinates = source.info.coordinates,
                          .schema = source.info.schema,
                          .crs = source.info.crs,
                          .las = source.info.las});
    }
    return result;
}

/// Kept points that may be held at a time, beside tiles in work.
std::uint64_t points_in_memory(std::uint64_t kept, const EmitRequest& request) {
    const std::uint64_t tile = std::min(kept, request.output.tile_points);
    const std::uint64_t least = emit_memory_bytes(kept, request.output);
    const std::uint64_t more =
        static_cast<std::uint64_t>(request.threads - 1) * encode_memory_bytes(tile);
    const std::uint64_t room = request.memory_bytes - least;
    return 2 * tile + (room - std::min(room, more)) / sizeof(LatticeIndex);
}

/// Removes what an earlier run, or this one, has left of kept points on disk.
void remove_kept_files(const std::filesystem::path& scratch) {
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(scratch, ignored)) {
        if (entry.path().filename().string().starts_with(kKeptFile)) {
            std::filesystem::remove(entry.path(), ignored);
        }
    }
}

/// Cuts kept points that the memory does not hold into tiles: halved on disk until a part fits.
class TilesThroughScratch {
  public:
    TilesThroughScratch(const SourceTable& sources, const Lattice& lattice, std::uint64_t capacity,
                        const EmitRequest& request, ArchiveWriter& writer)
        : sources_(sources),
          lattice_(lattice),
          capacity_(capacity),
          request_(request),
          writer_(writer),
          splitter_(sources, lattice, capacity, [&request] { request.advance(0); }) {}
    ~TilesThroughScratch() { remove_kept_files(request_.scratch); }
    TilesThroughScratch(const TilesThroughScratch&) = delete;
    TilesThroughScratch& operator=(const TilesThroughScratch&) = delete;

    void write(const KeptPoints& kept) {
        std::optional<KeptFileWriter> all;
        std::mutex mutex;
        TakeKept put = [&](const KeptBlock& block) {
            const std::scoped_lock lock(mutex);
            for (std::size_t i = 0; i < block.ids.size(); ++i) {
                all->add(block.ids[i], block.positions[i]);
            }
        };
        const std::filesystem::path path = next_path();
        const auto begin = [&] {
            all.reset();
            all.emplace(path, sources_, lattice_);
            return put;
        };
        read_kept(kept, request_.threads, begin, request_.advance);
        write(told(all->finish()));
    }

  private:
    // The lower half first, as plan_tiles() has it.
    void write(const KeptFile& file) {
        if (file.points > capacity_) {
            const auto [lower, upper] = splitter_.split(file, next_path(), next_path());
            told(lower);
            told(upper);
            remove(file);
            write(lower);
            write(upper);
            return;
        }
        std::vector<LatticeIndex> points;
        points.reserve(file.points);
        splitter_.read(file, [&](PointId, const Vec3&, const LatticeIndex& index) {
            points.push_back(index);
        });
        remove(file);
        writer_.add(points, request_.memory_bytes - points.size() * sizeof(LatticeIndex));
    }

    std::filesystem::path next_path() {
        return request_.scratch / fmt::format("{}{}.run", kKeptFile, files_++);
    }

    KeptFile told(KeptFile file) const {
        request_.on_scratch(static_cast<std::int64_t>(file.bytes));
        return file;
    }

    void remove(const KeptFile& file) const {
        std::filesystem::remove(file.path);
        request_.on_scratch(-static_cast<std::int64_t>(file.bytes));
    }

    const SourceTable& sources_;
    const Lattice& lattice_;
    std::uint64_t capacity_;
    const EmitRequest& request_;
    ArchiveWriter& writer_;
    KeptSplitter splitter_;
    int files_ = 0;
};

EmitResult emit_archive(const KeptPoints& kept, const EmitRequest& request) {
    const SourceTable& sources = kept.sources;
    const std::uint64_t count = kept.selection.count();
    check_memory(count, request);
    Manifest manifest;
    manifest.format_version = kArchiveFormatVersion;
    manifest.knap_version = KNAP_VERSION;
    manifest.parameters = request.parameters;
    manifest.sources = manifest_sources(sources);
    manifest.counts = request.counts;
    manifest.spacing = request.spacing;
    manifest.mean_curvature = request.mean_curvature;
    manifest.lattice = choose_lattice(request.output.step, sources, request.spacing);
    manifest.crs = common_crs(sources);
    const Lattice lattice = manifest.lattice;
    std::mutex polling;
    const auto poll = [&] {
        const std::scoped_lock lock(polling);
        request.advance(0);
    };
    const std::filesystem::path path = output_path(request.output.path);
    const auto on_whole = [&](const std::filesystem::path& folder, std::uint64_t tiles,
                              std::uint64_t bytes) {
        request.on_whole({path, tiles, bytes}, folder);
    };
    ArchiveWriter writer(std::move(manifest), {.folder = path,
                                               .tile_points = request.output.tile_points,
                                               .overwrite = request.output.overwrite,
                                               .threads = request.threads,
                                               .tiles = request.tiles,
                                               .on_whole = on_whole,
                                               .poll = poll});
    remove_kept_files(request.scratch);
    const std::uint64_t capacity = points_in_memory(count, request);
    if (count <= capacity) {
        std::vector<LatticeIndex> points = read_indices(kept, lattice, request);
        writer.add(points, request.memory_bytes - points.size() * sizeof(LatticeIndex));
    } else {
        TilesThroughScratch(sources, lattice, capacity, request, writer).write(kept);
    }
    const std::uint64_t bytes = writer.finish();
    return {path, writer.tiles(), bytes};
}

EmitResult emit_draco(const KeptPoints& kept, const EmitRequest& request) {
    check_memory(kept.selection.count(), request);
    const Lattice lattice = choose_lattice(request.output.step, kept.sources, request.spacing);
    std::vector<LatticeIndex> points = read_indices(kept, lattice, request);
    std::sort(points.begin(), points.end());
    const LatticeBounds bounds = bounds_of(points);
    if (!fits_tile(bounds)) {
        throw ConfigError(fmt::format(
            "output.path (--output): {}: expected kept points that span less than 2^{} lattice "
            "steps of {}, found {} x {} x {}; write an archive folder, or set a larger output.step",
            request.output.path, kTileBits, lattice.step, bounds.max[0] - bounds.min[0],
            bounds.max[1] - bounds.min[1], bounds.max[2] - bounds.min[2]));
    }
    const std::filesystem::path path = output_path(request.output.path);
    AtomicFile file(path);
    file.write(encode_tile(points, bounds.min, lattice, common_crs(kept.sources)));
    EmitResult result{path, 1, file.size()};
    request.on_whole(result, path.parent_path());
    file.commit();
    return result;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> result_parameters(const Job& job) {
    std::vector<std::pair<std::string, std::string>> result;
    for (const Parameter& parameter : parameters()) {
        if (parameter.in_result) {
            result.emplace_back(parameter.key, format_value(parameter, job));
        }
    }
    return result;
}

std::uint64_t emit_memory_bytes(std::uint64_t kept, const OutputParams& output) {
    switch (output_kind(output.path)) {
        case OutputKind::kArchive:
            return 2 * std::min(kept, output.tile_points) * sizeof(LatticeIndex) +
                   encode_memory_bytes(std::min(kept, output.tile_points));
        case OutputKind::kDraco:
            return kept * sizeof(LatticeIndex) + encode_memory_bytes(kept);
        case OutputKind::kCloud:
            break;
    }
    return 0;
}

EmitResult emit(const SourceTable& sources, const Selection& selection,
                const EmitRequest& request) {
    const OutputKind kind = output_kind(request.output.path);
    const AttributePlan attributes = plan_attributes(
        sources.infos(),
        kind == OutputKind::kCloud ? request.output.attributes : std::vector<std::string>{"none"});
    const KeptPoints kept{sources, selection, request.runs, attributes, request.note};
    switch (kind) {
        case OutputKind::kArchive:
            return emit_archive(kept, request);
        case OutputKind::kDraco:
            return emit_draco(kept, request);
        case OutputKind::kCloud:
            break;
    }
    return emit_single_file(kept, request);
}

}  // namespace knap
