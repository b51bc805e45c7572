#include "curvature/neighbour_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/threads.hpp"
#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"

namespace knap {
namespace {

// A cloud without coincident points, with ids in no order.
test::Points random_points(std::mt19937_64& random) {
    test::Points points = test::distinct_points(test::random_cloud(random));
    std::shuffle(points.ids.begin(), points.ids.end(), random);
    return points;
}

test::Points lattice(std::mt19937_64& random, int side, double step) {
    test::Points points;
    for (int i = 0; i < side * side * side; ++i) {
        points.positions.push_back(
            {i % side * step, i / side % side * step, i / (side * side) * step});
        points.ids.push_back(static_cast<PointId>(i));
    }
    std::shuffle(points.ids.begin(), points.ids.end(), random);
    return points;
}

void expect_nearest(const test::Points& points, const NeighbourSearch& search, const Vec3& query,
                    PointId self, std::size_t k, double max_squared) {
    std::vector<Neighbour> found;
    search.nearest(query, self, k, found, max_squared);
    const auto expected = test::nearest_by_force(points, query, self, k, max_squared);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        ASSERT_EQ(found[i].squared_distance, expected[i].squared_distance);
        ASSERT_EQ(points.ids[found[i].index], expected[i].id);
    }
}

TEST(NeighbourSearch, EqualsBruteForceWithTiesSettledById) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 200; ++round) {
        const test::Points points = round % 3 == 0
                                        ? lattice(random, static_cast<int>(2 + random() % 8), 0.1)
                                        : random_points(random);
        const NeighbourSearch search(points.positions, points.ids);
        for (std::size_t i = 0; i < points.ids.size(); i += 1 + random() % 20) {
            const std::size_t k = 1 + random() % 64;
            ASSERT_NO_FATAL_FAILURE(expect_nearest(points, search, points.positions[i],
                                                   points.ids[i], k,
                                                   std::numeric_limits<double>::infinity()))
                << "round " << round;
        }
    }
}

TEST(NeighbourSearch, FindsNeighboursOfAPlaceThatIsNotInTheCloud) {
    std::mt19937_64 random(2);
    for (int round = 0; round < 200; ++round) {
        const test::Points points = random_points(random);
        if (points.ids.empty()) {
            continue;
        }
        const NeighbourSearch search(points.positions, points.ids);
        const Vec3 size = points.box.size();
        for (int i = 0; i < 10; ++i) {
            const auto off = [&](double length) {
                return std::uniform_real_distribution<double>(-1, 2)(random) * length;
            };
            const Vec3 query = points.box.min + Vec3{off(size.x), off(size.y), off(size.z)};
            const PointId nobody = points.ids.size() + 100;
            ASSERT_NO_FATAL_FAILURE(expect_nearest(points, search, query, nobody, 1 + random() % 40,
                                                   std::numeric_limits<double>::infinity()));
        }
    }
}

TEST(NeighbourSearch, CountsPointsAtTheLimitAndNoneBeyond) {
    std::mt19937_64 random(3);
    for (int round = 0; round < 100; ++round) {
        const test::Points points =
            round % 2 == 0 ? lattice(random, 6, 0.1) : random_points(random);
        const NeighbourSearch search(points.positions, points.ids);
        for (std::size_t i = 0; i < points.ids.size(); i += 1 + random() % 40) {
            const Vec3& query = points.positions[i];
            const double exactly =
                squared_distance(query, points.positions[random() % points.ids.size()]);
            for (const double limit : {exactly, std::nextafter(exactly, 0.0), 0.0}) {
                ASSERT_NO_FATAL_FAILURE(
                    expect_nearest(points, search, query, points.ids[i], 1 + random() % 40, limit));
            }
        }
    }
}

TEST(NeighbourSearch, GivesTheSameFromManyThreads) {
    std::mt19937_64 random(4);
    const test::Points points = test::finite_points(test::sphere_cloud(2000, 9));
    const NeighbourSearch search(points.positions, points.ids);
    run_tasks(200, 4, [&](std::size_t i) {
        expect_nearest(points, search, points.positions[i], points.ids[i], 30,
                       std::numeric_limits<double>::infinity());
    });
}

TEST(NeighbourSearch, OfNothingOrForNoneFindsNone) {
    const NeighbourSearch nothing({}, {});
    std::vector<Neighbour> found{{1, 2}};
    nothing.nearest({0, 0, 0}, 0, 5, found);
    EXPECT_TRUE(found.empty());
    const std::vector<Vec3> points{{0, 0, 0}, {1, 0, 0}};
    const std::vector<PointId> ids{7, 8};
    const NeighbourSearch two(points, ids);
    found = {{1, 2}};
    two.nearest({0, 0, 0}, 7, 0, found);
    EXPECT_TRUE(found.empty());
    two.nearest({0, 0, 0}, 7, 5, found);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(ids[found[0].index], 8U);
}

}  // namespace
}  // namespace knap
