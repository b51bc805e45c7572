#include "rank/curvature_pass.hpp"

#include <algorithm>
#include <bit>
#include <boost/sort/spreadsort/integer_sort.hpp>
#include <cmath>
#include <limits>
#include <mutex>
#include <span>
#include <utility>

#include "base/threads.hpp"
#include "curvature/block_search.hpp"

namespace knap {

namespace {

// Blocks that a thread takes at a time, and stragglers.
constexpr std::size_t kGrainBlocks = 64;
constexpr std::size_t kGrainStragglers = 64;
constexpr std::size_t kFetched = 256;

// A point's rank by curvature alone, lowest first, and where it is; small, because sorting moves it
// about.
struct Place {
    std::uint64_t rank;
    std::uint32_t index;
};

// The bits of non-negative doubles order as they do.
std::uint64_t rank_of(double curvature) {
    return ~std::bit_cast<std::uint64_t>(curvature);
}

// In the method's order. Equal curvatures are few, so that they are put in order apart.
void sort_places(std::vector<Place>& places, const PointBlocks& brick) {
    boost::sort::spreadsort::integer_sort(
        places.begin(), places.end(),
        [](const Place& place, unsigned shift) { return place.rank >> shift; },
        [](const Place& a, const Place& b) { return a.rank < b.rank; });
    for (auto first = places.begin(); first != places.end();) {
        const auto last = std::find_if(
            first, places.end(), [&](const Place& place) { return place.rank != first->rank; });
        if (last - first > 1) {
            std::sort(first, last, [&](const Place& a, const Place& b) {
                return ranks_before(0, brick.ids[a.index], 0, brick.ids[b.index]);
            });
        }
        first = last;
    }
}

// |H| of each core point; NaN where the neighbours are not certain, whose bound is kept instead.
struct Pass {
    std::vector<double> curvature;
    std::vector<PackedFrame> frames;  // none where none are asked for
    std::vector<Straggler> stragglers;
};

Pass compute(const PointBlocks& brick, std::size_t k, const CurvatureEstimator& estimator,
             const Box& halo, const Box& archive,
             const std::function<void(std::uint64_t)>& advance) {
    Pass pass;
    pass.curvature.resize(brick.size(), std::numeric_limits<double>::quiet_NaN());
    pass.frames.resize(estimator.finds_frames() ? brick.size() : 0);
    std::mutex mutex;
    parallel_for(brick.blocks.size(), kGrainBlocks, [&](std::size_t first, std::size_t last) {
        BlockSearch search(brick, brick.is_core, k);
        CurvatureEstimator::Work work;
        std::vector<Straggler> stragglers;
        std::uint64_t handled = 0;
        for (std::size_t block = first; block < last; ++block) {
            const Neighbourhoods& found = search.around(block);
            handled += found.count;
            const std::span<const double> curvatures = estimator.mean_curvatures(found, work);
            for (std::size_t i = 0; i < found.count; ++i) {
                const std::uint32_t place = found.centres[i];
                const Vec3 p = brick.position(place);
                const double certain = certain_squared_distance(p, halo, archive);
                const double reach = found.squared_reaches[i];
                // With fewer than K others in reach of an unbounded halo, there are no more
                // anywhere.
                if (reach < certain || certain == std::numeric_limits<double>::infinity()) {
                    pass.curvature[place] = curvatures[i];
                    if (!pass.frames.empty()) {
                        pass.frames[place] = work.frames[i];
                    }
                } else {
                    stragglers.push_back({p, brick.ids[place], reach});
                }
            }
        }
        advance(handled);
        const std::scoped_lock lock(mutex);
        pass.stragglers.insert(pass.stragglers.end(), stragglers.begin(), stragglers.end());
    });
    return pass;
}

}  // namespace

RankedBrick rank_brick(const PointBlocks& brick, int neighbours,
                       const CurvatureEstimator& estimator, const Box& halo, const Box& archive,
                       const std::function<void(std::span<const RankedPoint>)>& take,
                       const std::function<void(std::uint64_t)>& advance) {
    Pass pass =
        compute(brick, static_cast<std::size_t>(neighbours), estimator, halo, archive, advance);
    RankedBrick ranked;
    std::vector<Place> places;
    places.reserve(brick.core_count);
    for (std::size_t i = 0; i < pass.curvature.size(); ++i) {
        if (pass.curvature[i] >= 0) {
            places.push_back({rank_of(pass.curvature[i]), static_cast<std::uint32_t>(i)});
            ranked.curvature_sum.add(pass.curvature[i]);
        }
    }
    sort_places(places, brick);
    ranked.points = places.size();
    // Points are fetched many at a time and only then handed on: fetching waits for memory, and
    // short steps wait together.
    std::vector<RankedPoint> fetched;
    for (std::size_t first = 0; first < places.size(); first += kFetched) {
        fetched.clear();
        for (const Place& place :
             std::span(places).subspan(first, std::min(kFetched, places.size() - first))) {
            fetched.push_back({pass.curvature[place.index], brick.ids[place.index],
                               brick.position(place.index),
                               pass.frames.empty() ? PackedFrame() : pass.frames[place.index]});
        }
        take(fetched);
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
                                         const CurvatureEstimator& estimator) {
    std::vector<RankedPoint> ranked(stragglers.size());
    parallel_for(stragglers.size(), kGrainStragglers, [&](std::size_t first, std::size_t last) {
        std::vector<Vec3> neighbourhood;
        for (std::size_t i = first; i < last; ++i) {
            neighbourhood.assign(1, stragglers[i].position);
            for (const FoundNeighbour& neighbour : neighbours[i]) {
                neighbourhood.push_back(neighbour.position);
            }
            const CurvatureEstimator::Estimate found = estimator.estimate(neighbourhood);
            ranked[i] = {found.curvature, stragglers[i].id, stragglers[i].position, found.frame};
        }
    });
    std::sort(ranked.begin(), ranked.end(),
              [](const RankedPoint& a, const RankedPoint& b) { return ranks_before(a, b); });
    return ranked;
}

}  // namespace knap
