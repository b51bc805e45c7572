#include "rank/ordered_brick.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include "base/threads.hpp"
#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"

namespace knap {
namespace {

constexpr test::Halo kHalos[] = {test::Halo::kPlanned, test::Halo::kNone, test::Halo::kAll};

// A brick of a random cloud, with its halo.
BrickPoints random_brick(std::mt19937_64& random) {
    for (;;) {
        const test::Points points = test::finite_points(test::random_cloud(random));
        test::CutCloud cut =
            test::cut_cloud(random, points, 1 + random() % 300, kHalos[random() % 3]);
        if (!cut.bricks.empty()) {
            return std::move(cut.bricks[random() % cut.bricks.size()].points);
        }
    }
}

double random_voxel(std::mt19937_64& random) {
    return std::pow(10, std::uniform_real_distribution<double>(-4, 3)(random));
}

BrickPoints shuffled(std::mt19937_64& random, const BrickPoints& brick) {
    std::vector<std::size_t> order(brick.ids.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto middle = order.begin() + static_cast<std::ptrdiff_t>(brick.core_count);
    std::shuffle(order.begin(), middle, random);
    std::shuffle(middle, order.end(), random);
    BrickPoints result;
    result.core_count = brick.core_count;
    for (const std::size_t i : order) {
        result.positions.push_back(brick.positions[i]);
        result.ids.push_back(brick.ids[i]);
    }
    return result;
}

TEST(OrderedBrick, KeepsTheLowestIdOfEachPlaceAndCountsTheRestOfTheCoreAsMerged) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 100; ++round) {
        const BrickPoints brick = random_brick(random);
        struct Place {
            PointId lowest;
            bool core;
        };
        std::map<std::array<double, 3>, Place> places;
        for (std::size_t i = 0; i < brick.ids.size(); ++i) {
            const Vec3& p = brick.positions[i];
            const bool core = i < brick.core_count;
            const auto [at, added] = places.try_emplace({p.x, p.y, p.z}, Place{brick.ids[i], core});
            at->second.lowest = std::min(at->second.lowest, brick.ids[i]);
            ASSERT_EQ(at->second.core, core) << "one voxel, one owner";
        }
        const OrderedBrick ordered = order_brick(brick, random_voxel(random));
        ASSERT_EQ(ordered.ids.size(), places.size());
        ASSERT_EQ(ordered.positions.size(), places.size());
        ASSERT_EQ(ordered.is_core.size(), places.size());
        std::uint64_t core = 0;
        for (std::size_t i = 0; i < ordered.ids.size(); ++i) {
            const Vec3& p = ordered.positions[i];
            const auto place = places.extract(std::array{p.x, p.y, p.z});
            ASSERT_FALSE(place.empty()) << "each place once";
            ASSERT_EQ(ordered.ids[i], place.mapped().lowest);
            ASSERT_EQ(ordered.is_core[i] != 0, place.mapped().core);
            core += ordered.is_core[i];
        }
        ASSERT_EQ(ordered.core_count, core);
        ASSERT_EQ(ordered.core_count + ordered.merged, brick.core_count);
    }
}

TEST(OrderedBrick, DoesNotDependOnTheOrderOfTheFileNorOnThreads) {
    std::mt19937_64 random(2);
    for (int round = 0; round < 60; ++round) {
        const BrickPoints brick = random_brick(random);
        const double voxel = random_voxel(random);
        const OrderedBrick first = order_brick(brick, voxel);
        const ThreadLimit limit(1 + round % 3);
        const OrderedBrick second = order_brick(shuffled(random, brick), voxel);
        ASSERT_EQ(first.ids, second.ids);
        ASSERT_EQ(first.positions, second.positions);
        ASSERT_EQ(first.is_core, second.is_core);
        ASSERT_EQ(first.merged, second.merged);
    }
}

TEST(OrderedBrick, HasTheSameSetForAnyVoxel) {
    std::mt19937_64 random(3);
    for (int round = 0; round < 60; ++round) {
        const BrickPoints brick = random_brick(random);
        std::vector<PointId> first = order_brick(brick, random_voxel(random)).ids;
        std::vector<PointId> second = order_brick(brick, random_voxel(random)).ids;
        std::sort(first.begin(), first.end());
        std::sort(second.begin(), second.end());
        ASSERT_EQ(first, second);
    }
}

TEST(OrderedBrick, TakesZeroOfEitherSignForOnePlace) {
    const OrderedBrick ordered =
        order_brick({{{0.0, 1, -0.0}, {-0.0, 1, 0.0}, {0.0, 2, 0.0}}, {5, 3, 9}, 3}, 0.1);
    EXPECT_EQ(ordered.merged, 1U);
    EXPECT_EQ(ordered.core_count, 2U);
    EXPECT_NE(std::find(ordered.ids.begin(), ordered.ids.end(), 3U), ordered.ids.end());
}

TEST(OrderedBrick, OfNothingIsEmpty) {
    const OrderedBrick ordered = order_brick({}, 1);
    EXPECT_TRUE(ordered.ids.empty());
    EXPECT_EQ(ordered.core_count + ordered.merged, 0U);
}

}  // namespace
}  // namespace knap
