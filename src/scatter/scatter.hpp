#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "input/staged_reader.hpp"
#include "knap/geometry.hpp"
#include "store/brick_map.hpp"
#include "store/brick_plan.hpp"
#include "store/checkpoint.hpp"
#include "store/source_table.hpp"

namespace knap {

struct ScatterRequest {
    std::filesystem::path folder;  ///< exists; gets a file a brick
    StagedPoints staged = {};  ///< as the survey left them; removed as they are no longer needed,
                               ///< if they do not stay
    int threads = 1;           ///< >= 1
    std::uint64_t budget_bytes = 0;  ///< for all buffers
    ScatterState state = {};         ///< where an earlier run stopped; brick files are as it says,
                                     ///< or longer
    /// Told the state whenever everything up to it is in the files.
    std::function<void(const ScatterState&)> commit = [](const ScatterState&) {};
    /// Told of damaged positions that the source stands in for, from any thread.
    std::function<void(const std::string&)> note = [](const std::string&) {};
};

/// Second pass over the archive: appends {position, id} of every finite point to the brick that
/// owns it and to every brick whose halo holds it. Of sources whose positions the survey has
/// written, only those are read.
///
/// No file stays open between appends, so any number of bricks will do.
/// @return one file a brick, in the order of the plan
/// @throws InputError if a source that is read has changed since the survey
/// @throws StorageError if the disk is full or fails, or a brick file is shorter than the state
/// says
std::vector<BrickFile> scatter(const SourceTable& table, const BrickPlan& plan, const BrickMap& map,
                               const ScatterRequest& request,
                               const std::function<void(std::uint64_t)>& advance);

/// Makes the file of one brick again, from the sources: for a file that was damaged since.
/// @throws InputError, StorageError as scatter()
void scatter_again(const SourceTable& table, const BrickPlan& plan, std::size_t brick,
                   const std::filesystem::path& folder, int threads);

/// The share of a position file's bytes that scatter() may still hold when the brick files are
/// nearly whole, for planning.
constexpr double kPositionsLeft = 1.0 / 16;

/// The files of a plan as a state has them.
std::vector<BrickFile> brick_files(const std::filesystem::path& folder, const BrickPlan& plan,
                                   const ScatterState& state);

/// Where scatter() puts the file of a brick.
std::filesystem::path brick_path(const std::filesystem::path& folder, std::size_t brick);

/// Bytes of memory that the buffers of scatter() can take, for planning.
std::uint64_t scatter_buffer_bytes(std::uint64_t bricks, int threads, std::uint64_t budget_bytes);

}  // namespace knap
