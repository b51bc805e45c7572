#pragma once

#include <cstdint>
#include <functional>

#include "pipeline/merge_stage.hpp"

namespace knap {

/// Adds points to what merge kept, where the surface is farthest off (repair.hpp), and leaves the
/// others as they were. What is done is in the log, and is not done again.
/// @param advance  told the points that were measured
void repair_archive(const MergeStage& stage, Merged& merged,
                    const std::function<void(std::uint64_t)>& advance);

}  // namespace knap
