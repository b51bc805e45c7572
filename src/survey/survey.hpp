#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "input/staged_reader.hpp"
#include "store/occupancy.hpp"
#include "store/source_table.hpp"

namespace knap {

struct SurveyRequest {
    std::vector<std::filesystem::path> files;
    int threads = 1;                 ///< >= 1
    std::uint64_t budget_bytes = 0;  ///< for the occupancy grids of all threads
    bool digests = true;             ///< also compute the XXH3-128 of each file
    /// Exists; gets the positions of the sources that position_bytes() counts. Empty: of none.
    std::filesystem::path positions = {};
    /// With `positions`, of each of `files`: columns, as PointSource::select() takes them, that go
    /// there too if its positions do. Empty: none of any.
    std::vector<std::vector<std::size_t>> columns = {};
    /// What is there stays to the end of the job.
    bool stays = false;
    /// Of `files`, the one that goes by the name "-". Empty: none.
    std::filesystem::path standard_input = {};
};

/// What the archive is: every point was seen once.
struct Survey {
    SourceTable table;
    Occupancy occupancy;
    StagedPoints staged = {};
};

/// Bytes of scratch, about, that the positions of such sources take whose points cost far more to
/// read than to read back: compressed ones and text. By what their headers say.
std::uint64_t position_bytes(const std::vector<SourceInfo>& infos);

/// The same for columns of such sources, before they are packed.
/// @param columns  as SurveyRequest has them
std::uint64_t column_bytes(const std::vector<SourceInfo>& infos,
                           const std::vector<std::vector<std::size_t>>& columns);

/// First pass over the archive: counts, bounds, rejected points, digests, and points per voxel;
/// and positions and columns of slow sources, so that they need not be read twice.
/// @param advance  told how many points were read since the last call; from any thread
/// @throws InputError if a source does not hold what its header says, or the bounds are so wide
///         that squares of distances overflow
/// @throws StorageError if positions cannot be written
Survey survey(const SurveyRequest& request, const std::function<void(std::uint64_t)>& advance);

/// Memory that the survey takes beside the grids, for planning: readers and their chunks.
/// @param columns_size  bytes of the columns of a point
std::uint64_t survey_overhead_bytes(int threads, std::size_t columns_size = 0);

}  // namespace knap
