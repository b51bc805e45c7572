#include "rank/spacing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <span>

#include "base/checksum.hpp"
#include "base/threads.hpp"
#include "curvature/neighbour_search.hpp"
#include "rank/ordered_brick.hpp"
#include "rank/point_grid.hpp"

namespace knap {

namespace {

constexpr std::uint64_t kAllBelow = 1'000'000;
constexpr double kSampled = 1'250'000;

struct Sampled {
    std::uint32_t index;
    double squared_distance;
};

// The tree finds what the voxels did not. Points that another of lower id stands for are dropped.
std::vector<Sampled> search_by_tree(const BrickPoints& brick, double order_voxel,
                                    std::span<const std::uint32_t> lost) {
    const OrderedBrick merged = order_brick(brick, order_voxel);
    std::vector<PointId> counted = merged.ids;
    std::sort(counted.begin(), counted.end());
    std::vector<Sampled> found;
    for (const std::uint32_t index : lost) {
        if (std::binary_search(counted.begin(), counted.end(), brick.ids[index])) {
            found.push_back({index, std::numeric_limits<double>::infinity()});
        }
    }
    const NeighbourSearch search(merged.positions, merged.ids);
    constexpr std::size_t kGrain = 64;
    parallel_for(found.size(), kGrain, [&](std::size_t first, std::size_t last) {
        std::vector<Neighbour> nearest;
        for (std::size_t i = first; i < last; ++i) {
            const std::uint32_t index = found[i].index;
            search.nearest(brick.positions[index], brick.ids[index], 1, nearest);
            if (!nearest.empty()) {
                found[i].squared_distance = nearest.front().squared_distance;
            }
        }
    });
    return found;
}

}  // namespace

SpacingSample::SpacingSample(std::uint64_t points)
    : threshold_(points <= kAllBelow
                     ? std::numeric_limits<std::uint64_t>::max()
                     : static_cast<std::uint64_t>(
                           std::min(kSampled / static_cast<double>(points), 1 - 1e-9) * 0x1p64)) {}

bool SpacingSample::contains(PointId id) const {
    // Another hash than the one that breaks ties in the order.
    constexpr std::uint64_t kSalt = 0x5bd1e995'9e3779b9U;
    return splitmix64(id ^ kSalt) <= threshold_;
}

BrickSpacing brick_spacing(const BrickPoints& brick, const SpacingSample& sample, const Box& halo,
                           const Box& archive, double order_voxel) {
    const PointGrid grid(brick.positions, order_voxel);
    BrickSpacing result;
    std::vector<std::uint32_t> lost;
    std::mutex mutex;
    const auto settle = [&](BrickSpacing& part, const Sampled& point) {
        const Vec3& p = brick.positions[point.index];
        if (point.squared_distance < certain_squared_distance(p, halo, archive)) {
            part.sum.add(std::sqrt(point.squared_distance));
            ++part.count;
        } else {
            part.stragglers.push_back({p, brick.ids[point.index], point.squared_distance});
        }
    };
    constexpr std::size_t kGrain = 8192;
    parallel_for(brick.core_count, kGrain, [&](std::size_t first, std::size_t last) {
        BrickSpacing part;
        std::vector<std::uint32_t> part_lost;
        for (std::size_t i = first; i < last; ++i) {
            if (!sample.contains(brick.ids[i])) {
                continue;
            }
            const auto index = static_cast<std::uint32_t>(i);
            const PointGrid::Nearest nearest = grid.nearest_other(index, brick.ids);
            if (!nearest.complete) {
                part_lost.push_back(index);
            } else if (nearest.lowest_id) {
                settle(part, {index, nearest.squared_distance});
            }
        }
        const std::scoped_lock lock(mutex);
        result.sum.add(part.sum);
        result.count += part.count;
        result.stragglers.insert(result.stragglers.end(), part.stragglers.begin(),
                                 part.stragglers.end());
        lost.insert(lost.end(), part_lost.begin(), part_lost.end());
    });
    if (!lost.empty()) {
        for (const Sampled& point : search_by_tree(brick, order_voxel, lost)) {
            settle(result, point);
        }
    }
    return result;
}

}  // namespace knap
