#pragma once

#include <cstdint>
#include <vector>

#include "knap/geometry.hpp"
#include "store/brick_file.hpp"

namespace knap {

/// A brick ready for work: neighbouring points near each other, coincident points merged into the
/// one of lowest id. The order depends on the set of points only, not on that of the brick's file.
struct OrderedBrick {
    std::vector<Vec3> positions;
    std::vector<PointId> ids;
    std::vector<std::uint8_t> is_core;  ///< 1: the brick owns the point; 0: it is halo
    std::uint64_t core_count = 0;       ///< after merging
    std::uint64_t merged = 0;           ///< core points that another stands for
};

/// Orders a brick by voxels and merges coincident points. Takes the brick, to free it on the way.
/// @param order_voxel  edge of the voxels to order by, > 0, cloud units; does not change the set
OrderedBrick order_brick(BrickPoints brick, double order_voxel);

}  // namespace knap
