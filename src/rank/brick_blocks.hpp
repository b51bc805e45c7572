#pragma once

#include "curvature/point_blocks.hpp"
#include "store/brick_file.hpp"

namespace knap {

/// The points of a brick in blocks, coincident ones merged. Takes the brick, to free it on the way.
PointBlocks block_brick(BrickPoints brick);

}  // namespace knap
