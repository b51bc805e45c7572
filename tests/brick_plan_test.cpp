#include "store/brick_plan.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace knap {
namespace {

double uniform(std::mt19937_64& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

VoxelCoord voxel_at(const Vec3& p, double size) {
    return {static_cast<std::int32_t>(voxel_index(p.x, size)),
            static_cast<std::int32_t>(voxel_index(p.y, size)),
            static_cast<std::int32_t>(voxel_index(p.z, size))};
}

Brick random_brick(std::mt19937_64& random, double voxel_size) {
    Brick brick;
    for (int axis = 0; axis < 3; ++axis) {
        const auto low = static_cast<std::int32_t>(random() % 200) - 100;
        const auto high = low + static_cast<std::int32_t>(random() % 20);
        brick.core.min[axis] = low;
        brick.core.max[axis] = high;
        // The halo may end at the archive's box, inside the core's outermost voxels.
        brick.halo.min[axis] = (low + uniform(random, -3, 0.4)) * voxel_size;
        brick.halo.max[axis] = (high + 1 + uniform(random, -0.4, 3)) * voxel_size;
    }
    return brick;
}

TEST(BrickPlan, VoxelsTouchedHoldTheCoreAndEveryPointOfTheHalo) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 2000; ++round) {
        const double size = std::ldexp(1.0, static_cast<int>(random() % 20) - 10);
        const Brick brick = random_brick(random, size);
        const VoxelBox touched = voxels_touched(brick, size);
        ASSERT_TRUE(touched.contains(brick.core.min));
        ASSERT_TRUE(touched.contains(brick.core.max));
        ASSERT_TRUE(touched.contains(voxel_at(brick.halo.min, size)));
        ASSERT_TRUE(touched.contains(voxel_at(brick.halo.max, size)));
        for (int i = 0; i < 20; ++i) {
            Vec3 p;
            for (int axis = 0; axis < 3; ++axis) {
                p[axis] = uniform(random, brick.halo.min[axis], brick.halo.max[axis]);
            }
            ASSERT_TRUE(touched.contains(voxel_at(p, size)));
        }
    }
}

TEST(BrickPlan, VoxelsTouchedAreNoMoreThanCoreAndHaloNeed) {
    std::mt19937_64 random(2);
    for (int round = 0; round < 2000; ++round) {
        const double size = std::ldexp(1.0, static_cast<int>(random() % 20) - 10);
        const Brick brick = random_brick(random, size);
        const VoxelBox touched = voxels_touched(brick, size);
        for (int axis = 0; axis < 3; ++axis) {
            ASSERT_TRUE(touched.min[axis] == brick.core.min[axis] ||
                        (touched.min[axis] + 1) * size > brick.halo.min[axis]);
            ASSERT_TRUE(touched.max[axis] == brick.core.max[axis] ||
                        touched.max[axis] * size <= brick.halo.max[axis]);
        }
    }
}

}  // namespace
}  // namespace knap
