#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "store/occupancy.hpp"
#include "store/source_table.hpp"

namespace knap {

struct SurveyRequest {
    std::vector<std::filesystem::path> files;
    int threads = 1;                 ///< >= 1
    std::uint64_t budget_bytes = 0;  ///< for the occupancy grids of all threads
    bool digests = true;             ///< also compute the XXH3-128 of each file
};

/// What the archive is: every point was seen once.
struct Survey {
    SourceTable table;
    Occupancy occupancy;
};

/// First pass over the archive: counts, bounds, rejected points, digests, and points per voxel.
/// @param advance  told how many points were read since the last call; from any thread
/// @throws InputError if a source does not hold what its header says, or the bounds are so wide
///         that squares of distances overflow
Survey survey(const SurveyRequest& request, const std::function<void(std::uint64_t)>& advance);

/// Memory that the survey takes beside the grids, for planning: readers and their chunks.
std::uint64_t survey_overhead_bytes(int threads);

}  // namespace knap
