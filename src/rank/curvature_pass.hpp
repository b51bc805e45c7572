#pragma once

#include <cstdint>
#include <vector>

#include "base/exact_sum.hpp"
#include "curvature/fourier.hpp"
#include "curvature/point_blocks.hpp"
#include "rank/gather.hpp"
#include "store/ranked_run.hpp"

namespace knap {

/// The core points of one brick, ranked.
struct RankedBrick {
    std::vector<RankedPoint> points;    ///< those with certified neighbours, best first
    std::vector<Straggler> stragglers;  ///< the others, farthest bound first
    ExactSum curvature_sum;             ///< of |H| over `points`, 1 / cloud unit
};

/// Mean curvature at every core point whose K nearest neighbours are certain to lie in the brick,
/// in the method's order.
/// @param halo     the brick holds every point of the archive in this box
/// @param archive  box of all points
RankedBrick rank_brick(const PointBlocks& brick, int neighbours, const FourierEstimator& estimator,
                       const Box& halo, const Box& archive);

/// Mean curvature at stragglers, whose neighbours were gathered; in the method's order.
std::vector<RankedPoint> rank_stragglers(std::span<const Straggler> stragglers,
                                         std::span<const std::vector<FoundNeighbour>> neighbours,
                                         const FourierEstimator& estimator);

}  // namespace knap
