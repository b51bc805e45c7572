#include "emit/emit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "base/file.hpp"
#include "emit/archive_writer.hpp"
#include "emit/draco_tile.hpp"
#include "emit/kept_points.hpp"
#include "emit/lattice.hpp"
#include "emit/measures.hpp"
#include "emit/output_check.hpp"
#include "emit/scratch_tiles.hpp"
#include "emit/single_file.hpp"
#include "emit/tiles.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "store/manifest.hpp"

namespace knap {

namespace {

/// Memory that writing takes, beside the measures.
std::uint64_t writing_bytes(std::uint64_t kept, const OutputParams& output,
                            const AttributePlan& attributes) {
    switch (output_kind(output.path)) {
        case OutputKind::kArchive:
            return 2 * std::min(kept, output.tile_points) * emit_point_bytes(attributes) +
                   encode_memory_bytes(std::min(kept, output.tile_points), attributes.attributes);
        case OutputKind::kDraco:
            return kept * (sizeof(LatticeIndex) + sizeof(CarryingPoint) + attributes.row_size) +
                   encode_memory_bytes(kept, attributes.attributes);
        case OutputKind::kCloud:
            break;
    }
    return 0;
}

void require_memory(std::uint64_t kept, std::uint64_t needed, const EmitRequest& request) {
    if (needed > request.memory_bytes) {
        throw StorageError(fmt::format(
            "{}: {} kept points need {} of memory to be written, expected at most {} "
            "(resources.memory)",
            request.output.path, kept, format_bytes(needed), format_bytes(request.memory_bytes)));
    }
}

void check_memory(std::uint64_t kept, const AttributePlan& attributes, const EmitRequest& request) {
    require_memory(kept, writing_bytes(kept, request.output, attributes), request);
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

/// The kept points on the lattice with what they carry, in the order of ids.
struct Carried {
    std::vector<CarryingPoint> points;
    std::vector<std::byte> rows;

    std::uint64_t bytes() const { return points.size() * sizeof(CarryingPoint) + rows.size(); }
};

Carried read_carried(const KeptPoints& kept, const Lattice& lattice, const EmitRequest& request) {
    const std::size_t row_size = kept.attributes.row_size;
    Carried carried{std::vector<CarryingPoint>(kept.selection.count()),
                    std::vector<std::byte>(kept.selection.count() * row_size)};
    TakeKept put = [&](const KeptBlock& block) {
        for (std::size_t i = 0; i < block.positions.size(); ++i) {
            carried.points[block.place + i] = {index_of(lattice, block.positions[i]),
                                               block.place + i};
        }
        std::copy(block.rows.begin(), block.rows.end(),
                  carried.rows.begin() + static_cast<std::ptrdiff_t>(block.place * row_size));
    };
    read_kept(
        kept, request.threads, [&] { return put; }, request.advance);
    return carried;
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
std::uint64_t points_in_memory(std::uint64_t kept, const AttributePlan& attributes,
                               const EmitRequest& request) {
    const std::uint64_t tile = std::min(kept, request.output.tile_points);
    const std::uint64_t least = writing_bytes(kept, request.output, attributes);
    const std::uint64_t more = static_cast<std::uint64_t>(request.threads - 1) *
                               encode_memory_bytes(tile, attributes.attributes);
    const std::uint64_t room = request.memory_bytes - least;
    return 2 * tile + (room - std::min(room, more)) / emit_point_bytes(attributes);
}

EmitResult emit_archive(const KeptPoints& kept, const EmitRequest& request) {
    const SourceTable& sources = kept.sources;
    const std::uint64_t count = kept.selection.count();
    check_memory(count, kept.attributes, request);
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
    manifest.attributes = kept.attributes.attributes;
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
                                               .encoding = request.output.encoding,
                                               .threads = request.threads,
                                               .tiles = request.tiles,
                                               .on_whole = on_whole,
                                               .poll = poll});
    remove_kept_files(request.scratch);
    const std::uint64_t capacity = points_in_memory(count, kept.attributes, request);
    if (count > capacity) {
        write_tiles_through_scratch(kept, lattice, capacity, request, writer);
    } else if (kept.attributes.empty()) {
        std::vector<LatticeIndex> points = read_indices(kept, lattice, request);
        writer.add(points, request.memory_bytes - points.size() * sizeof(LatticeIndex));
    } else {
        Carried carried = read_carried(kept, lattice, request);
        writer.add(carried.points, carried.rows, request.memory_bytes - carried.bytes());
    }
    const std::uint64_t bytes = writer.finish();
    return {path, writer.tiles(), bytes};
}

EmitResult emit_draco(const KeptPoints& kept, const EmitRequest& request) {
    check_memory(kept.selection.count(), kept.attributes, request);
    const Lattice lattice = choose_lattice(request.output.step, kept.sources, request.spacing);
    const Carried carried = read_carried(kept, lattice, request);
    std::vector<LatticeIndex> points;
    points.reserve(carried.points.size());
    for (const CarryingPoint& point : carried.points) {
        points.push_back(point.index);
    }
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
    file.write(encode_smallest({points, carried.rows, bounds.min},
                               {lattice, common_crs(kept.sources), kept.attributes.attributes},
                               request.output.encoding));
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

std::uint64_t emit_point_bytes(const AttributePlan& attributes) {
    return attributes.empty() ? sizeof(LatticeIndex) : sizeof(CarryingPoint) + attributes.row_size;
}

std::uint64_t emit_memory_bytes(std::uint64_t kept, const OutputParams& output,
                                const AttributePlan& attributes) {
    return writing_bytes(kept, output, attributes) +
           (attributes.measures ? Measures::memory_bytes(kept) : 0);
}

EmitResult emit(const SourceTable& sources, const Selection& selection,
                const EmitRequest& request) {
    const AttributePlan attributes = plan_output(sources.infos(), request.output);
    EmitRequest remaining = request;
    std::optional<Measures> measures;
    if (attributes.measures) {
        const std::uint64_t kept = selection.count();
        require_memory(kept, emit_memory_bytes(kept, request.output, attributes), request);
        remaining.memory_bytes -= Measures::memory_bytes(kept);
        measures.emplace(sources, selection, request.runs, request.range_of, request.threads);
    }
    const KeptPoints kept{.sources = sources,
                          .selection = selection,
                          .runs = remaining.runs,
                          .attributes = attributes,
                          .note = remaining.note,
                          .staged = &remaining.staged,
                          .measures = measures ? &*measures : nullptr};
    switch (output_kind(remaining.output.path)) {
        case OutputKind::kArchive:
            return emit_archive(kept, remaining);
        case OutputKind::kDraco:
            return emit_draco(kept, remaining);
        case OutputKind::kCloud:
            break;
    }
    return emit_single_file(kept, remaining);
}

}  // namespace knap
