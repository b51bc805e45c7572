#include "rank/curvature_pass.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <random>

#include "base/threads.hpp"
#include "rank/brick_blocks.hpp"
#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"
#include "support/reference.hpp"

namespace knap {
namespace {

constexpr test::Halo kHalos[] = {test::Halo::kPlanned, test::Halo::kNone, test::Halo::kAll};

std::map<PointId, Vec3> by_id(const test::Points& points) {
    std::map<PointId, Vec3> positions;
    for (std::size_t i = 0; i < points.ids.size(); ++i) {
        positions[points.ids[i]] = points.positions[i];
    }
    return positions;
}

// |H| of every distinct point, its neighbours found by looking at every other.
std::map<PointId, double> curvature_by_force(const test::Points& distinct, int neighbours,
                                             const CurvatureEstimator& estimator) {
    const std::map<PointId, Vec3> positions = by_id(distinct);
    std::map<PointId, double> curvature;
    for (const auto& [id, position] : positions) {
        std::vector<Vec3> neighbourhood{position};
        for (const test::Found& found :
             test::nearest_by_force(distinct, position, id, static_cast<std::size_t>(neighbours))) {
            neighbourhood.push_back(positions.at(found.id));
        }
        curvature[id] = estimator.mean_curvature(neighbourhood);
    }
    return curvature;
}

bool in_order(const std::vector<RankedPoint>& points) {
    return std::is_sorted(
        points.begin(), points.end(),
        [](const RankedPoint& a, const RankedPoint& b) { return ranks_before(a, b); });
}

double random_spacing(std::mt19937_64& random, const Box& box) {
    const double diagonal = box.diagonal() > 0 ? box.diagonal() : 1;
    return diagonal * std::pow(10, std::uniform_real_distribution<double>(-3, -1)(random));
}

void nobody(std::span<const RankedPoint> /*points*/) {}

TEST(CurvaturePass, ABrickWithItsHaloEqualsTheWholeCloudBitForBit) {
    std::mt19937_64 random(1);
    std::size_t certified = 0;
    std::size_t stragglers = 0;
    for (int round = 0; round < 150; ++round) {
        const std::vector<Vec3> cloud = test::random_cloud(random);
        const test::Points distinct = test::distinct_points(cloud);
        const int neighbours = static_cast<int>(3 + random() % 60);
        const CurvatureEstimator estimator({}, random_spacing(random, distinct.box));
        const auto expected = curvature_by_force(distinct, neighbours, estimator);
        const ThreadLimit limit(1 + round % 3);
        const test::CutCloud cut = test::cut_cloud(random, test::finite_points(cloud),
                                                   1 + random() % 300, kHalos[round % 3]);
        std::map<PointId, Vec3> owners = by_id(distinct);
        for (const test::CutBrick& brick : cut.bricks) {
            std::vector<RankedPoint> points;
            std::atomic<std::uint64_t> handled{0};
            const RankedBrick ranked = rank_brick(
                block_brick(brick.points), neighbours, estimator, brick.brick.halo, cut.box,
                [&](std::span<const RankedPoint> some) {
                    points.insert(points.end(), some.begin(), some.end());
                },
                [&](std::uint64_t count) { handled += count; });
            ASSERT_EQ(points.size(), ranked.points);
            ASSERT_EQ(handled, ranked.points + ranked.stragglers.size());
            ASSERT_TRUE(in_order(points));
            std::vector<double> keys;
            for (const RankedPoint& point : points) {
                ASSERT_EQ(point.key, expected.at(point.id)) << "round " << round;
                ASSERT_EQ(owners.extract(point.id).mapped(), point.position);
                keys.push_back(point.key);
            }
            ASSERT_EQ(ranked.curvature_sum.value(), reference::exact_sum(keys));
            certified += points.size();
            for (const Straggler& straggler : ranked.stragglers) {
                ASSERT_EQ(owners.extract(straggler.id).mapped(), straggler.position);
            }
            stragglers += ranked.stragglers.size();
        }
        ASSERT_TRUE(owners.empty()) << "every counted point is ranked or a straggler of one brick";
    }
    EXPECT_GT(certified, 1000U);
    EXPECT_GT(stragglers, 1000U);
}

TEST(CurvaturePass, BoundsOfStragglersHoldTheirTrueNeighboursFarthestFirst) {
    std::mt19937_64 random(2);
    for (int round = 0; round < 60; ++round) {
        const std::vector<Vec3> cloud = test::random_cloud(random);
        const test::Points distinct = test::distinct_points(cloud);
        const CurvatureEstimator estimator({}, random_spacing(random, distinct.box));
        const test::CutCloud cut = test::cut_cloud(random, test::finite_points(cloud),
                                                   1 + random() % 300, kHalos[round % 2]);
        constexpr int kNeighbours = 10;
        for (const test::CutBrick& brick : cut.bricks) {
            const RankedBrick ranked = rank_brick(block_brick(brick.points), kNeighbours, estimator,
                                                  brick.brick.halo, cut.box, nobody);
            double last = std::numeric_limits<double>::infinity();
            for (const Straggler& straggler : ranked.stragglers) {
                ASSERT_LE(straggler.bound_squared, last);
                last = straggler.bound_squared;
                const auto nearest =
                    test::nearest_by_force(distinct, straggler.position, straggler.id, kNeighbours);
                if (nearest.size() == kNeighbours) {
                    ASSERT_LE(nearest.back().squared_distance, straggler.bound_squared);
                } else {
                    ASSERT_EQ(straggler.bound_squared, std::numeric_limits<double>::infinity());
                }
            }
        }
    }
}

TEST(CurvaturePass, ABrickThatSeesTheWholeArchiveHasNoStragglers) {
    std::mt19937_64 random(3);
    for (int round = 0; round < 100; ++round) {
        const test::Points points = test::finite_points(test::random_cloud(random));
        const CurvatureEstimator estimator({}, random_spacing(random, points.box));
        for (const test::CutBrick& brick :
             test::cut_cloud(random, points, 200, test::Halo::kAll).bricks) {
            EXPECT_TRUE(
                rank_brick(block_brick(brick.points), 30, estimator, points.box, points.box, nobody)
                    .stragglers.empty());
        }
    }
}

TEST(CurvaturePass, RanksStragglersByTheirGatheredNeighbours) {
    std::mt19937_64 random(4);
    for (int round = 0; round < 60; ++round) {
        const test::Points distinct = test::distinct_points(test::random_cloud(random));
        constexpr int kNeighbours = 20;
        const CurvatureEstimator estimator({}, random_spacing(random, distinct.box));
        const std::map<PointId, Vec3> positions = by_id(distinct);
        std::vector<Straggler> stragglers;
        std::vector<std::vector<FoundNeighbour>> neighbours;
        for (const auto& [id, position] : positions) {
            stragglers.push_back({position, id});
            neighbours.emplace_back();
            for (const test::Found& found :
                 test::nearest_by_force(distinct, position, id, kNeighbours)) {
                neighbours.back().push_back(
                    {found.squared_distance, found.id, positions.at(found.id)});
            }
        }
        const std::vector<RankedPoint> ranked = rank_stragglers(stragglers, neighbours, estimator);
        ASSERT_EQ(ranked.size(), stragglers.size());
        ASSERT_TRUE(in_order(ranked));
        const auto expected = curvature_by_force(distinct, kNeighbours, estimator);
        for (const RankedPoint& point : ranked) {
            ASSERT_EQ(point.key, expected.at(point.id));
            ASSERT_EQ(point.position, positions.at(point.id));
        }
    }
}

}  // namespace
}  // namespace knap
