#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "knap/geometry.hpp"
#include "knap/source.hpp"
#include "store/brick_plan.hpp"
#include "store/occupancy.hpp"
#include "store/source_table.hpp"

/// What a job must know to go on where it stopped: small binary files in the scratch folder.
///
///     file    magic:8 version:u32 reserved:u32 size:u64 checksum:u64 payload
///
/// The checksum is XXH3-64 of the payload. Each appears whole or not at all. All loading throws
/// StorageError if a file is missing, torn or fails its checksum. Prose: docs/formats.md.
namespace knap {

/// What the survey found, without what the files say of themselves.
void save_survey(const std::filesystem::path& path, const SourceTable& table,
                 const Occupancy& occupancy);

struct SavedSurvey {
    SourceTable table;
    Occupancy occupancy;
};

/// @param infos  what the files say of themselves now, in the same order
SavedSurvey load_survey(const std::filesystem::path& path, std::span<const SourceInfo> infos);

void save_plan(const std::filesystem::path& path, const BrickPlan& plan);
BrickPlan load_plan(const std::filesystem::path& path);

/// How far the sources have been scattered.
struct ScatterState {
    /// One brick file as it was when the state was saved; what was appended since does not count.
    struct Tally {
        std::uint64_t bytes = 0;
        std::uint64_t core_points = 0;
        std::uint64_t halo_points = 0;
        Box core_box;
    };

    std::uint64_t parts_done = 0;
    std::vector<Tally> bricks;  ///< of the plan, in its order; none: nothing was scattered
};

void save_scatter_state(const std::filesystem::path& path, const ScatterState& state);
ScatterState load_scatter_state(const std::filesystem::path& path);

}  // namespace knap
