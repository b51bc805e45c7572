#pragma once

#include <cstddef>
#include <filesystem>

#include "pipeline/job_log.hpp"
#include "rank/rank.hpp"

namespace knap {

/// How far an earlier run ranked the archive, by its log.
/// @param folder  the scratch folder
RankState read_rank_state(const JobLog& log, const std::filesystem::path& folder,
                          std::size_t bricks);

void record_spacing(JobLog& log, double spacing);
void record_brick(JobLog& log, std::size_t brick, const BrickRank& ranked);
void record_stragglers(JobLog& log, const SettledStragglers& settled);

}  // namespace knap
