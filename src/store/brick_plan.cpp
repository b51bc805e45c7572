#include "store/brick_plan.hpp"

#include <algorithm>

namespace knap {

VoxelBox voxels_touched(const Brick& brick, double voxel_size) {
    VoxelBox touched;
    for (int axis = 0; axis < 3; ++axis) {
        touched.min[axis] =
            std::min(brick.core.min[axis],
                     static_cast<std::int32_t>(voxel_index(brick.halo.min[axis], voxel_size)));
        touched.max[axis] =
            std::max(brick.core.max[axis],
                     static_cast<std::int32_t>(voxel_index(brick.halo.max[axis], voxel_size)));
    }
    return touched;
}

}  // namespace knap
