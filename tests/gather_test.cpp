#include "rank/gather.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "base/threads.hpp"
#include "knap/error.hpp"
#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"

namespace knap {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Cores of the bricks of a cut, counting which of them are loaded.
struct Cores {
    explicit Cores(const test::CutCloud& cut) {
        for (const test::CutBrick& brick : cut.bricks) {
            const auto count = static_cast<std::ptrdiff_t>(brick.points.core_count);
            points.push_back(
                {{brick.points.positions.begin(), brick.points.positions.begin() + count},
                 {brick.points.ids.begin(), brick.points.ids.begin() + count}});
            access.boxes.push_back(brick.core_box);
        }
        access.load = [this](std::size_t brick) {
            loaded.insert(brick);
            return points[brick];
        };
    }
    Cores(const Cores&) = delete;

    std::vector<CorePoints> points;
    std::set<std::size_t> loaded;
    CoreAccess access;
};

void expect_true_neighbours(const test::Points& points, const std::vector<Straggler>& stragglers,
                            std::size_t k, const std::vector<std::vector<FoundNeighbour>>& found) {
    ASSERT_EQ(found.size(), stragglers.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        const auto expected =
            test::nearest_by_force(points, stragglers[i].position, stragglers[i].id, k);
        ASSERT_EQ(found[i].size(), expected.size());
        for (std::size_t n = 0; n < expected.size(); ++n) {
            ASSERT_EQ(found[i][n].id, expected[n].id);
            ASSERT_EQ(found[i][n].squared_distance, expected[n].squared_distance);
            ASSERT_EQ(squared_distance(stragglers[i].position, found[i][n].position),
                      expected[n].squared_distance);
        }
    }
}

TEST(Gather, EqualsBruteForceAcrossRandomBricks) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 150; ++round) {
        const test::Points points = test::distinct_points(test::random_cloud(random));
        const Cores cores(test::cut_cloud(random, points, 1 + random() % 200, test::Halo::kNone));
        const std::size_t k = 1 + random() % 60;
        std::vector<Straggler> stragglers;
        for (std::size_t i = 0; i < points.ids.size(); i += 1 + random() % 10) {
            Straggler straggler{points.positions[i], points.ids[i], kInfinity};
            const auto nearest =
                test::nearest_by_force(points, straggler.position, straggler.id, k);
            // The bound may be the true distance itself, or any above.
            if (random() % 2 == 0 && nearest.size() == k) {
                straggler.bound_squared =
                    nearest.back().squared_distance * (random() % 2 == 0 ? 1 : 1.5);
            }
            stragglers.push_back(straggler);
        }
        const ThreadLimit limit(1 + round % 3);
        ASSERT_NO_FATAL_FAILURE(
            expect_true_neighbours(points, stragglers, k, gather(stragglers, k, cores.access)))
            << "round " << round;
    }
}

TEST(Gather, LoadsOnlyBricksThatCanHoldANeighbour) {
    std::mt19937_64 random(2);
    const test::Points points = test::distinct_points(test::sphere_cloud(20000, 5));
    const Cores cores(test::cut_cloud(random, points, 500, test::Halo::kNone));
    ASSERT_GT(cores.points.size(), 30U);
    const auto nearest = test::nearest_by_force(points, points.positions[0], points.ids[0], 30);
    const Straggler straggler{points.positions[0], points.ids[0], nearest.back().squared_distance};
    gather({&straggler, 1}, 30, cores.access);
    for (const std::size_t brick : cores.loaded) {
        EXPECT_LE(cores.access.boxes[brick].squared_distance_to(straggler.position),
                  straggler.bound_squared);
    }
    EXPECT_LT(cores.loaded.size(), 9U) << "at most the eight that meet in a corner";
}

TEST(Gather, OfNoStragglersLoadsNothing) {
    std::mt19937_64 random(3);
    const test::Points points = test::distinct_points(test::sphere_cloud(1000, 5));
    const Cores cores(test::cut_cloud(random, points, 100, test::Halo::kNone));
    EXPECT_TRUE(gather({}, 30, cores.access).empty());
    EXPECT_TRUE(cores.loaded.empty());
}

TEST(Gather, HandsOnWhatABrickThrows) {
    CoreAccess cores;
    cores.boxes.resize(1);
    cores.boxes[0].extend(Vec3{0, 0, 0});
    cores.load = [](std::size_t) -> CorePoints { throw StorageError("000000.run: damaged"); };
    const Straggler straggler{{1, 1, 1}, 5};
    EXPECT_THROW(gather({&straggler, 1}, 3, cores), StorageError);
}

TEST(CertainSquaredDistance, NoPointOutsideTheHaloIsNearer) {
    std::mt19937_64 random(4);
    std::size_t bounded = 0;
    for (int round = 0; round < 300; ++round) {
        const test::Points points = test::finite_points(test::random_cloud(random));
        const auto halo = round % 2 == 0 ? test::Halo::kPlanned : test::Halo::kNone;
        const test::CutCloud cut = test::cut_cloud(random, points, 1 + random() % 200, halo);
        for (const test::CutBrick& brick : cut.bricks) {
            const Vec3& p = brick.points.positions[random() % brick.points.core_count];
            const double certain = certain_squared_distance(p, brick.brick.halo, cut.box);
            bounded += certain < kInfinity ? 1 : 0;
            for (const Vec3& q : points.positions) {
                ASSERT_TRUE(brick.brick.halo.contains(q) || squared_distance(p, q) >= certain);
            }
        }
    }
    EXPECT_GT(bounded, 1000U);
}

TEST(CertainSquaredDistance, IsInfiniteInsideTheWholeArchiveAndZeroOutsideTheHalo) {
    Box box;
    box.extend(Vec3{0, 0, 0});
    box.extend(Vec3{4, 4, 4});
    EXPECT_EQ(certain_squared_distance({1, 2, 3}, box, box), kInfinity);
    Box half = box;
    half.max.x = 2;
    EXPECT_EQ(certain_squared_distance({1.5, 2, 3}, half, box), 0.25);
    EXPECT_EQ(certain_squared_distance({2, 2, 3}, half, box), 0);
    EXPECT_EQ(certain_squared_distance({3, 2, 3}, half, box), 0);
}

}  // namespace
}  // namespace knap
