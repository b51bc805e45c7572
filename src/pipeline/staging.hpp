#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "emit/attribute_plan.hpp"
#include "knap/job.hpp"

namespace knap {

/// What the survey of a job leaves in scratch of slow sources.
struct Staging {
    std::filesystem::path folder;  ///< empty: nothing
    /// Of each source, what a later stage reads beside positions.
    std::vector<std::vector<std::size_t>> columns;
    bool stays = false;       ///< to the end of the job; else only until the points are scattered
    std::uint64_t bytes = 0;  ///< of what stays, at most, about

    /// Bytes of the columns of a point, of the source that has most.
    std::size_t columns_size = 0;
};

/// Of each source the columns that the stages after the survey read: for the output and for
/// range.keep.
/// @throws ConfigError as plan_attributes()
std::vector<std::vector<std::size_t>> columns_read_later(const Job& job,
                                                         const std::vector<SourceInfo>& infos);

/// Positions and columns for the whole job, where a stage after scatter reads sources and the disk
/// has room for them beside all else; or positions for scatter alone; or nothing.
/// @param scratch     exists
/// @param free_bytes  of its disk
Staging plan_staging(const Job& job, const std::vector<SourceInfo>& infos,
                     const std::filesystem::path& scratch, std::uint64_t free_bytes);

}  // namespace knap
