#include "rank/curvature_pass.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <span>
#include <utility>

#include "base/threads.hpp"
#include "curvature/neighbour_search.hpp"

namespace knap {

namespace {

constexpr std::size_t kGrain = 512;
// Far above the rounding of a few additions and square roots.
constexpr double kRoundingMargin = 1 + 1e-9;

// A place in the order and where the point is; small, because sorting moves it about.
struct Place {
    double key;
    std::uint32_t index;
};

// |H| of each core point; NaN where the neighbours are not certain, whose bound is kept instead.
struct Pass {
    std::vector<double> curvature;
    std::vector<Straggler> stragglers;
};

Pass compute(const OrderedBrick& brick, std::size_t k, const FourierEstimator& estimator,
             const Box& halo, const Box& archive) {
    const NeighbourSearch search(brick.positions, brick.ids);
    Pass pass;
    pass.curvature.resize(brick.ids.size(), std::numeric_limits<double>::quiet_NaN());
    std::mutex mutex;
    parallel_for(brick.ids.size(), kGrain, [&](std::size_t first, std::size_t last) {
        std::vector<Neighbour> nearest;
        std::vector<Straggler> stragglers;
        std::array<Vec3, kMostNeighbourhood> neighbourhood;
        Vec3 previous;
        double previous_reach = std::numeric_limits<double>::infinity();
        for (std::size_t i = first; i < last; ++i) {
            if (brick.is_core[i] == 0) {
                continue;
            }
            const Vec3& p = brick.positions[i];
            // The K neighbours of the point before, and that point, are within this distance.
            const double known = previous_reach + std::sqrt(squared_distance(p, previous));
            search.nearest(p, brick.ids[i], k, nearest, known * known * kRoundingMargin);
            const double certain = certain_squared_distance(p, halo, archive);
            const double reach = nearest.size() == k ? nearest.back().squared_distance
                                                     : std::numeric_limits<double>::infinity();
            previous = p;
            previous_reach = std::sqrt(reach);
            // With fewer than K others in reach of an unbounded halo, there are no more anywhere.
            if (!(reach < certain) && certain != std::numeric_limits<double>::infinity()) {
                stragglers.push_back({p, brick.ids[i], reach});
                continue;
            }
            neighbourhood[0] = p;
            for (std::size_t n = 0; n < nearest.size(); ++n) {
                neighbourhood[n + 1] = brick.positions[nearest[n].index];
            }
            pass.curvature[i] =
                estimator.mean_curvature(std::span(neighbourhood).first(nearest.size() + 1));
        }
        const std::scoped_lock lock(mutex);
        pass.stragglers.insert(pass.stragglers.end(), stragglers.begin(), stragglers.end());
    });
    return pass;
}

}  // namespace

RankedBrick rank_brick(OrderedBrick brick, int neighbours, const FourierEstimator& estimator,
                       const Box& halo, const Box& archive) {
    Pass pass = compute(brick, static_cast<std::size_t>(neighbours), estimator, halo, archive);
    RankedBrick ranked;
    std::vector<Place> places;
    places.reserve(brick.core_count);
    for (std::size_t i = 0; i < pass.curvature.size(); ++i) {
        if (pass.curvature[i] >= 0) {
            places.push_back({pass.curvature[i], static_cast<std::uint32_t>(i)});
            ranked.curvature_sum.add(pass.curvature[i]);
        }
    }
    std::sort(places.begin(), places.end(), [&](const Place& a, const Place& b) {
        return ranks_before(a.key, brick.ids[a.index], b.key, brick.ids[b.index]);
    });
    ranked.points.reserve(places.size());
    for (const Place& place : places) {
        ranked.points.push_back({place.key, brick.ids[place.index], brick.positions[place.index]});
    }
    ranked.stragglers = std::move(pass.stragglers);
    std::sort(ranked.stragglers.begin(), ranked.stragglers.end(),
              [](const Straggler& a, const Straggler& b) {
                  return a.bound_squared > b.bound_squared ||
                         (a.bound_squared == b.bound_squared && a.id < b.id);
              });
    return ranked;
}

std::vector<RankedPoint> rank_stragglers(std::span<const Straggler> stragglers,
                                         std::span<const std::vector<FoundNeighbour>> neighbours,
                                         const FourierEstimator& estimator) {
    std::vector<RankedPoint> ranked(stragglers.size());
    parallel_for(stragglers.size(), kGrain, [&](std::size_t first, std::size_t last) {
        std::vector<Vec3> neighbourhood;
        for (std::size_t i = first; i < last; ++i) {
            neighbourhood.assign(1, stragglers[i].position);
            for (const FoundNeighbour& neighbour : neighbours[i]) {
                neighbourhood.push_back(neighbour.position);
            }
            ranked[i] = {estimator.mean_curvature(neighbourhood), stragglers[i].id,
                         stragglers[i].position};
        }
    });
    std::sort(ranked.begin(), ranked.end(),
              [](const RankedPoint& a, const RankedPoint& b) { return ranks_before(a, b); });
    return ranked;
}

}  // namespace knap
