#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "emit/attribute_plan.hpp"
#include "emit/tile_log.hpp"
#include "input/staged_reader.hpp"
#include "knap/job.hpp"
#include "knap/params.hpp"
#include "store/selection.hpp"
#include "store/source_table.hpp"

namespace knap {

struct EmitResult {
    std::filesystem::path path;
    std::uint64_t tiles = 0;  ///< Draco files
    std::uint64_t bytes = 0;  ///< of the whole output
};

/// What the output says of the job, and what making it may use.
struct EmitRequest {
    Counts counts;
    double spacing = 0;  ///< mean distance to the nearest other point, cloud units; 0: no two
    double mean_curvature = 0;                                    ///< 1 / cloud unit
    std::vector<std::pair<std::string, std::string>> parameters;  ///< see result_parameters()
    OutputParams output;
    std::uint64_t memory_bytes = 0;  ///< that emit may use; does not change the result
    int threads = 1;                 ///< >= 1; does not change the result
    std::filesystem::path scratch;   ///< exists; for kept points that the memory does not hold
    std::vector<std::filesystem::path> runs = {};  ///< as KeptPoints has them
    /// The range of a curvature, for output.measures, which takes runs; from any thread.
    std::function<double(double)> range_of = nullptr;
    StagedPoints staged = {};  ///< stands in for sources
    TileLog tiles = {};        ///< of an archive that an earlier run began
    /// Told input points done with, one call at a time.
    std::function<void(std::uint64_t)> advance = [](std::uint64_t) {};
    /// Told how many bytes of scratch a new file takes, or one that is gone gave back.
    std::function<void(std::int64_t)> on_scratch = [](std::int64_t) {};
    /// Told once the output is whole, before it gets its name; `folder` is where it lies, that of
    /// an archive under its temporary name. What it throws stops the job without an output.
    std::function<void(const EmitResult& result, const std::filesystem::path& folder)> on_whole =
        [](const EmitResult&, const std::filesystem::path&) {};
    /// Told of a damaged file in scratch that the sources stand in for, from any thread.
    std::function<void(const std::string&)> note = [](const std::string&) {};
};

/// Key and value of all parameters that shape the result, as the manifest names them.
std::vector<std::pair<std::string, std::string>> result_parameters(const Job& job);

/// Memory that emit() takes for an output of some kept points, at least: what it checks its budget
/// against. For an archive it does not grow
/// beyond what two tiles take: more kept points go through scratch.
std::uint64_t emit_memory_bytes(std::uint64_t kept, const OutputParams& output,
                                const AttributePlan& attributes = {});

/// Bytes of a kept point that emit() holds in memory until its tile is written.
std::uint64_t emit_point_bytes(const AttributePlan& attributes);

/// Writes the kept points: an archive folder, a single Draco file, or an ordinary file with the
/// exact positions in source order, for which the sources are streamed a last time. A cloud without
/// kept points gives an archive without tiles, or a file without points.
///
/// @param selection  finished, of sources.points() ids
/// @throws ConfigError   if the lattice step does not suit the box, or a single Draco file
/// @throws InputError    if a source changed since the survey
/// @throws StorageError  if the budget is below emit_memory_bytes(), or the disk fails; what was
///                       there before is untouched then, and nothing is left but the finished
///                       tiles, if request.tiles is told of them
EmitResult emit(const SourceTable& sources, const Selection& selection, const EmitRequest& request);

}  // namespace knap
