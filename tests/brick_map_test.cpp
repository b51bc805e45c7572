#include "store/brick_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <tuple>

#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"

namespace knap {
namespace {

struct Bricks {
    std::vector<VoxelBox> cores;
    std::vector<VoxelBox> reaches;
};

// Cores are the occupied cells of a lattice of `edge` voxels; reaches are wider by up to 9 a side.
Bricks random_bricks(std::mt19937_64& random, const Occupancy& occupancy) {
    const auto edge = static_cast<std::int32_t>(1 + random() % 20);
    const auto floor_to_edge = [&](std::int32_t v) {
        return (v >= 0 ? v / edge : -((edge - 1 - v) / edge)) * edge;
    };
    std::map<std::tuple<std::int32_t, std::int32_t, std::int32_t>, VoxelBox> cells;
    for (const Voxel& voxel : occupancy.voxels()) {
        const VoxelCoord low{floor_to_edge(voxel.at.x), floor_to_edge(voxel.at.y),
                             floor_to_edge(voxel.at.z)};
        const VoxelCoord high{low.x + edge - 1, low.y + edge - 1, low.z + edge - 1};
        cells[{low.x, low.y, low.z}] = {low, high};
    }
    Bricks bricks;
    for (const auto& [low, core] : cells) {
        bricks.cores.push_back(core);
    }
    std::shuffle(bricks.cores.begin(), bricks.cores.end(), random);
    for (const VoxelBox& core : bricks.cores) {
        VoxelBox reach = core;
        for (int axis = 0; axis < 3; ++axis) {
            reach.min[axis] -= static_cast<std::int32_t>(random() % 10);
            reach.max[axis] += static_cast<std::int32_t>(random() % 10);
        }
        bricks.reaches.push_back(reach);
    }
    return bricks;
}

VoxelCoord voxel_at(const Vec3& p, double size) {
    return {static_cast<std::int32_t>(voxel_index(p.x, size)),
            static_cast<std::int32_t>(voxel_index(p.y, size)),
            static_cast<std::int32_t>(voxel_index(p.z, size))};
}

TEST(BrickMap, NamesTheOwnerOfEveryPointFirstAndThenAllWhoseReachHoldsIt) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 150; ++round) {
        const test::Points points = test::finite_points(test::random_cloud(random));
        const Occupancy occupancy =
            test::occupancy_of(points, static_cast<double>(1 + random() % 80));
        const Bricks bricks = random_bricks(random, occupancy);
        const BrickMap map(occupancy, bricks.cores, bricks.reaches);
        BrickMap::Reader reader(map);
        for (const Vec3& p : points.positions) {
            const VoxelCoord voxel = voxel_at(p, occupancy.voxel_size());
            std::vector<std::uint32_t> expected;
            for (std::uint32_t i = 0; i < bricks.cores.size(); ++i) {
                if (bricks.cores[i].contains(voxel)) {
                    expected.insert(expected.begin(), i);
                } else if (bricks.reaches[i].contains(voxel)) {
                    expected.push_back(i);
                }
            }
            const auto found = reader.bricks_at(p);
            ASSERT_EQ(std::vector(found.begin(), found.end()), expected);
            ASSERT_TRUE(bricks.cores[found.front()].contains(voxel));
        }
    }
}

TEST(BrickMap, KnowsNoBrickWhereNothingIs) {
    std::mt19937_64 random(2);
    const test::Points points = test::finite_points(test::sphere_cloud(1000, 1));
    const Occupancy occupancy = test::occupancy_of(points, 40);
    const Bricks bricks = random_bricks(random, occupancy);
    const BrickMap map(occupancy, bricks.cores, bricks.reaches);
    BrickMap::Reader reader(map);
    EXPECT_TRUE(reader.bricks_at({0, 0, 0}).empty()) << "the middle of a hollow sphere";
    EXPECT_TRUE(reader.bricks_at({1000, -1000, 5}).empty());
    EXPECT_TRUE(reader.bricks_at({1e300, -1e300, 5}).empty()) << "no such voxel number";
}

TEST(BrickMap, OfNothingKnowsNoBrick) {
    const BrickMap map(Occupancy(1, 1), {}, {});
    BrickMap::Reader reader(map);
    EXPECT_TRUE(reader.bricks_at({0, 0, 0}).empty());
}

}  // namespace
}  // namespace knap
