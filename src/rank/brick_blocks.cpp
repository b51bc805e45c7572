#include "rank/brick_blocks.hpp"

#include <utility>
#include <vector>

namespace knap {

PointBlocks block_brick(BrickPoints brick) {
    std::vector<TaggedPoint> points;
    points.reserve(brick.ids.size());
    for (std::size_t i = 0; i < brick.ids.size(); ++i) {
        points.emplace_back(brick.positions[i], brick.ids[i], i < brick.core_count);
    }
    brick = {};
    return make_blocks(std::move(points));
}

}  // namespace knap
