#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "knap/export.hpp"
#include "knap/geometry.hpp"
#include "knap/params.hpp"
#include "knap/source.hpp"

namespace knap {

/// Where every input point went: in == kept + represented + merged + rejected.
struct Counts {
    std::uint64_t in = 0;
    std::uint64_t kept = 0;         ///< written to the output
    std::uint64_t represented = 0;  ///< within the range of a kept point
    std::uint64_t merged = 0;       ///< coincident with a point of lower id
    std::uint64_t rejected = 0;     ///< a coordinate was not finite
    friend bool operator==(const Counts&, const Counts&) = default;
};

/// What one stage cost.
struct StageReport {
    std::string name;
    double seconds = 0;
    double cpu_seconds = 0;    ///< of all threads of the process
    std::uint64_t points = 0;  ///< points that went through the stage
};

/// What a job did.
struct Report {
    Counts counts;
    double spacing = 0;         ///< mean distance to the nearest other point, cloud units
    double alpha = 0;           ///< range at mean curvature, given or found, cloud units
    double mean_curvature = 0;  ///< mean |H| over all counted points, 1 / cloud unit
    Box box;                    ///< of the finite input points
    std::uint64_t sources = 0;
    std::uint64_t bricks = 0;
    std::uint64_t stragglers = 0;  ///< points whose neighbours were gathered from other bricks
    std::uint64_t protected_points = 0;  ///< of the kept ones: for the sake of range.keep alone
    std::uint64_t tiles = 0;
    std::uint64_t output_bytes = 0;
    std::uint64_t tileset_tiles = 0;  ///< of the 3D Tiles, where some are asked for
    std::uint64_t tileset_bytes = 0;  ///< not among output_bytes
    std::uint64_t scratch_peak_bytes = 0;
    std::uint64_t memory_peak_bytes = 0;  ///< resident memory of the process
    std::vector<StageReport> stages;
    std::filesystem::path output;
};

/// What a job would need, foretold after the survey.
struct Forecast {
    std::uint64_t points = 0;  ///< in all sources
    std::uint64_t rejected = 0;
    Box box;
    double voxel_size = 0;  ///< cloud units
    std::uint64_t occupied_voxels = 0;
    std::uint64_t bricks = 0;
    std::uint64_t largest_brick = 0;  ///< core + halo points
    std::uint64_t halo_points = 0;    ///< copies over all bricks
    std::uint64_t memory_bytes = 0;   ///< peak resident memory
    std::uint64_t scratch_bytes = 0;  ///< peak use of the scratch folder
    std::uint64_t scratch_free_bytes = 0;
    std::vector<SourceInfo> sources;
};

/// Watches a job. Methods may be called from any thread, one at a time.
/// An exception thrown here stops the job and reaches its caller.
class KNAP_API Progress {
  public:
    virtual ~Progress() = default;
    /// @param total  points that the stage will handle; 0 if not known
    virtual void begin(std::string_view /*stage*/, std::uint64_t /*total*/) {}
    /// @param points  handled since the last call
    virtual void advance(std::uint64_t /*points*/) {}
    virtual void end(const StageReport& /*stage*/) {}
    /// Something the user should know that is no error.
    virtual void note(std::string_view /*message*/) {}
};

/// Runs a job out of core: survey, plan, scatter, rank, merge, emit.
///
/// The output is the same, byte for byte, whatever `job.resources` says.
/// @throws ConfigError, InputError, StorageError; the output then does not exist
KNAP_API Report run(const Job& job, Progress& progress);

/// Surveys the sources and plans the bricks; writes nothing but a scratch folder that is gone
/// after.
/// @throws ConfigError, InputError, StorageError
KNAP_API Forecast forecast(const Job& job, Progress& progress);

}  // namespace knap
