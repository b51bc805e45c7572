#include "rank/held_bricks.hpp"

#include <algorithm>

#include "curvature/point_blocks.hpp"

namespace knap {

std::uint64_t rank_bytes_per_point() {
    // The blocks, a curvature and a place in the order each; before that, making the blocks.
    return std::max<std::uint64_t>(PointBlocks::kBytesPerPoint + 3 * sizeof(double),
                                   PointBlocks::kMakingBytesPerPoint);
}

HeldBricks held_bricks(std::span<const std::uint64_t> points, int threads,
                       std::uint64_t budget_bytes) {
    if (points.empty()) {
        return {};
    }
    const std::uint64_t in_work = static_cast<std::uint64_t>(std::max(threads, 1)) *
                                  rank_bytes_per_point() *
                                  *std::max_element(points.begin(), points.end());
    const std::uint64_t room = budget_bytes - std::min(budget_bytes, in_work);
    HeldBricks held;
    for (const std::uint64_t brick : points) {
        const std::uint64_t bytes = brick * PointBlocks::kBytesPerPoint;
        if (held.bytes + bytes > room) {
            break;
        }
        held.bytes += bytes;
        ++held.count;
    }
    return held;
}

}  // namespace knap
