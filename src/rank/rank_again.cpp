#include "rank/rank_again.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <span>

#include "curvature/estimator.hpp"
#include "rank/brick_blocks.hpp"
#include "rank/curvature_pass.hpp"

namespace knap {

std::vector<RankedPoint> rank_again(const SourceTable& table, const BrickFile& file,
                                    const CurvatureParams& params, bool frames, double spacing,
                                    const CoreAccess& archive) {
    const CurvatureEstimator estimator(params, spacing, frames);
    std::vector<RankedPoint> certain;
    certain.reserve(file.core_points);
    const RankedBrick brick =
        rank_brick(load_brick(file, table), params.neighbours, estimator, file.brick.halo,
                   table.box(), [&](std::span<const RankedPoint> points) {
                       certain.insert(certain.end(), points.begin(), points.end());
                   });
    const auto k = static_cast<std::size_t>(params.neighbours);
    const std::vector<RankedPoint> others =
        rank_stragglers(brick.stragglers, gather(brick.stragglers, k, archive), estimator);
    std::vector<RankedPoint> all;
    all.reserve(certain.size() + others.size());
    std::merge(certain.begin(), certain.end(), others.begin(), others.end(),
               std::back_inserter(all),
               [](const RankedPoint& a, const RankedPoint& b) { return ranks_before(a, b); });
    return all;
}

}  // namespace knap
