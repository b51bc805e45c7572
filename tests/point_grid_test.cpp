#include "rank/point_grid.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"

namespace knap {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// From one voxel for all points to far more voxels than points.
double random_voxel(std::mt19937_64& random, const Box& box) {
    const double longest = box.diagonal() > 0 ? box.diagonal() : 1;
    return longest * std::pow(10, std::uniform_real_distribution<double>(-8, 1)(random));
}

TEST(PointGrid, OrdersEachPointOnceVoxelByVoxel) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 40; ++round) {
        const test::Points points = test::finite_points(test::random_cloud(random));
        const PointGrid grid(points.positions, random_voxel(random, points.box));
        std::vector<std::uint32_t> begins;
        const std::vector<std::uint32_t> order = grid.order(begins);
        std::vector<std::uint32_t> sorted = order;
        std::sort(sorted.begin(), sorted.end());
        ASSERT_EQ(sorted.size(), points.ids.size());
        for (std::uint32_t i = 0; i < sorted.size(); ++i) {
            ASSERT_EQ(sorted[i], i) << "a permutation";
        }
        begins.push_back(static_cast<std::uint32_t>(order.size()));
        ASSERT_EQ(begins.front(), 0U);
        for (std::size_t voxel = 0; voxel + 1 < begins.size(); ++voxel) {
            ASSERT_LT(begins[voxel], begins[voxel + 1]) << "no voxel is empty";
            ASSERT_TRUE(
                std::is_sorted(order.begin() + begins[voxel], order.begin() + begins[voxel + 1]));
        }
    }
}

TEST(PointGrid, PutsCoincidentPointsIntoOneVoxelAndOthersNearThemOnly) {
    std::mt19937_64 random(2);
    for (int round = 0; round < 200; ++round) {
        const test::Points points = test::finite_points(test::random_cloud(random));
        const double longest = points.box.diagonal();
        const double voxel_size = (longest > 0 ? longest : 1) * 0.03;
        const PointGrid grid(points.positions, voxel_size);
        std::vector<std::uint32_t> begins;
        const std::vector<std::uint32_t> order = grid.order(begins);
        std::vector<std::size_t> voxel_of(points.ids.size());
        for (std::size_t at = 0, voxel = 0; at < order.size(); ++at) {
            voxel += voxel + 1 < begins.size() && begins[voxel + 1] == at ? 1 : 0;
            voxel_of[order[at]] = voxel;
        }
        for (std::size_t i = 0; i < points.ids.size(); ++i) {
            const std::size_t j = random() % points.ids.size();
            const Vec3& a = points.positions[i];
            const Vec3& b = points.positions[j];
            if (a == b) {
                ASSERT_EQ(voxel_of[i], voxel_of[j]);
            } else if (voxel_of[i] == voxel_of[j]) {
                for (int axis = 0; axis < 3; ++axis) {
                    ASSERT_LE(std::abs(a[axis] - b[axis]), voxel_size * (1 + 1e-9));
                }
            }
        }
    }
}

TEST(PointGrid, TheNearestOtherEqualsBruteForceWheneverItIsComplete) {
    std::mt19937_64 random(3);
    std::size_t complete = 0;
    std::size_t asked = 0;
    for (int round = 0; round < 40; ++round) {
        test::Points points = test::finite_points(test::random_cloud(random));
        std::shuffle(points.ids.begin(), points.ids.end(), random);
        const PointGrid grid(points.positions, random_voxel(random, points.box));
        for (std::uint32_t i = 0; i < points.ids.size();
             i += 1 + static_cast<std::uint32_t>(random() % 9)) {
            const PointGrid::Nearest found = grid.nearest_other(i, points.ids);
            double nearest = kInfinity;
            bool lowest_id = true;
            for (std::size_t j = 0; j < points.ids.size(); ++j) {
                if (points.positions[j] == points.positions[i]) {
                    lowest_id = lowest_id && points.ids[j] >= points.ids[i];
                } else {
                    nearest = std::min(nearest,
                                       squared_distance(points.positions[i], points.positions[j]));
                }
            }
            ++asked;
            ASSERT_GE(found.squared_distance, nearest);
            if (found.complete) {
                ++complete;
                ASSERT_EQ(found.squared_distance, nearest) << "round " << round;
                ASSERT_EQ(found.lowest_id, lowest_id);
            }
        }
    }
    EXPECT_GT(complete, asked / 20);
    EXPECT_LT(complete, asked);
}

TEST(PointGrid, FindsTheNearestOtherWhereAFewPointsShareAVoxel) {
    const test::Points points = test::finite_points(test::sphere_cloud(20000, 4));
    // About six points a voxel face of the sphere.
    const PointGrid grid(points.positions, std::sqrt(6 * 4 * 3.14159 / 20000));
    std::size_t complete = 0;
    for (std::uint32_t i = 0; i < 20000; ++i) {
        complete += grid.nearest_other(i, points.ids).complete ? 1 : 0;
    }
    EXPECT_EQ(complete, 20000U);
}

TEST(PointGrid, OfOnePointFindsNoOther) {
    const std::vector<Vec3> one{{1e6, 0, -3}};
    const std::vector<PointId> ids{4};
    const PointGrid grid(one, 0.1);
    const PointGrid::Nearest found = grid.nearest_other(0, ids);
    EXPECT_EQ(found.squared_distance, kInfinity);
    EXPECT_FALSE(found.complete);
    EXPECT_TRUE(found.lowest_id);
}

TEST(PointGrid, OfNothingHasNoOrder) {
    const PointGrid grid({}, 1);
    std::vector<std::uint32_t> begins{7};
    EXPECT_TRUE(grid.order(begins).empty());
    EXPECT_TRUE(begins.empty());
}

}  // namespace
}  // namespace knap
