#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/exact_sum.hpp"
#include "curvature/estimator.hpp"
#include "curvature/point_blocks.hpp"
#include "rank/gather.hpp"
#include "store/ranked_run.hpp"

namespace knap {

/// The core points of one brick, ranked.
struct RankedBrick {
    std::uint64_t points = 0;           ///< those with certified neighbours
    ExactSum curvature_sum;             ///< of their |H|, 1 / cloud unit
    std::vector<Straggler> stragglers;  ///< the others, farthest bound first
};

/// Mean curvature at every core point whose K nearest neighbours are certain to lie in the brick,
/// in the method's order.
/// @param halo     the brick holds every point of the archive in this box
/// @param archive  box of all points
/// @param take     told all of them, some at a time, in that order, once all are known
/// @param advance  told how many points were handled; from any thread; may throw to stop the work
RankedBrick rank_brick(
    const PointBlocks& brick, int neighbours, const CurvatureEstimator& estimator, const Box& halo,
    const Box& archive, const std::function<void(std::span<const RankedPoint>)>& take,
    const std::function<void(std::uint64_t)>& advance = [](std::uint64_t) {});

/// Mean curvature at stragglers, whose neighbours were gathered; in the method's order.
std::vector<RankedPoint> rank_stragglers(std::span<const Straggler> stragglers,
                                         std::span<const std::vector<FoundNeighbour>> neighbours,
                                         const CurvatureEstimator& estimator);

}  // namespace knap
