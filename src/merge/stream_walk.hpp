#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "merge/merge.hpp"
#include "store/ranked_run.hpp"

namespace knap {

/// Walks all streams in one global order, holding only the kept points: a point that no kept point
/// has marked is kept and marks every point within its range (method section 4).
///
/// Points are taken in batches: a batch is tested in parallel against what was kept before it, and
/// the few survivors are settled in order.
/// @param streams  each in the method's order
/// @param keep     told the kept points, in the method's order, some at a time
/// @param advance  told how many points were walked
/// @throws StorageError if the kept points need more memory than the budget, with the figures
void walk_streams(std::vector<std::unique_ptr<RankedStream>> streams, const MergeRequest& request,
                  const std::function<void(std::span<const RankedPoint>)>& keep,
                  const std::function<void(std::uint64_t)>& advance);

}  // namespace knap
