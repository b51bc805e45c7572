#include "rank/ordered_brick.hpp"

#include <algorithm>
#include <array>

#include "base/threads.hpp"
#include "rank/point_grid.hpp"

namespace knap {

namespace {

std::array<double, 3> coordinates(const Vec3& p) {
    return {p.x, p.y, p.z};
}

}  // namespace

OrderedBrick order_brick(BrickPoints brick, double order_voxel) {
    std::vector<std::uint32_t> begins;
    std::vector<std::uint32_t> order = PointGrid(brick.positions, order_voxel).order(begins);
    begins.push_back(static_cast<std::uint32_t>(order.size()));
    const std::vector<Vec3>& positions = brick.positions;
    const std::vector<PointId>& ids = brick.ids;

    // Coincident points share a voxel; sorted by coordinates, then id, they stand side by side
    // with the lowest id first.
    constexpr std::size_t kGrain = 1024;
    parallel_for(begins.size() - 1, kGrain, [&](std::size_t first, std::size_t last) {
        for (std::size_t voxel = first; voxel < last; ++voxel) {
            std::sort(order.begin() + begins[voxel], order.begin() + begins[voxel + 1],
                      [&](std::uint32_t a, std::uint32_t b) {
                          const auto pa = coordinates(positions[a]);
                          const auto pb = coordinates(positions[b]);
                          return pa < pb || (pa == pb && ids[a] < ids[b]);
                      });
        }
    });

    OrderedBrick result;
    result.positions.reserve(order.size());
    result.ids.reserve(order.size());
    result.is_core.reserve(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        const std::uint32_t at = order[i];
        const bool core = at < brick.core_count;
        if (i > 0 && positions[at] == positions[order[i - 1]]) {
            result.merged += core ? 1 : 0;
            continue;
        }
        result.positions.push_back(positions[at]);
        result.ids.push_back(ids[at]);
        result.is_core.push_back(core ? 1 : 0);
        result.core_count += core ? 1 : 0;
    }
    return result;
}

}  // namespace knap
