#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "input/staged_reader.hpp"
#include "knap/job.hpp"
#include "pipeline/merge_stage.hpp"

namespace knap {

/// The selection with the protected points, in the scratch folder and in the log.
constexpr const char* kProtectedFile = "protected";

/// Refuses an expression (range.keep) that cannot be read, or asked of the sources.
/// @throws ConfigError
void check_keep(const Job& job, const std::vector<std::filesystem::path>& files);

/// Adds the points that range.keep holds for to the kept ones. Of coincident points the one of
/// lowest id is added, if any of them is held. What is done is in the log, and is not done again.
///
/// @param staged   stands in for sources
/// @param threads  >= 1
/// @param advance  told the points that were looked at
void protect_points(const MergeStage& stage, const StagedPoints& staged, int threads,
                    Merged& merged, const std::function<void(std::uint64_t)>& advance);

}  // namespace knap
