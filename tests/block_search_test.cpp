#include "curvature/block_search.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "curvature/neighbour_search.hpp"
#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"

namespace knap {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

PointBlocks blocks_of(const std::vector<Vec3>& cloud) {
    std::vector<TaggedPoint> points;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
        if (is_finite(cloud[i])) {
            points.emplace_back(cloud[i], i, true);
        }
    }
    return make_blocks(std::move(points));
}

std::vector<Vec3> lattice(int side, double step) {
    std::vector<Vec3> cloud;
    for (int i = 0; i < side * side * side; ++i) {
        cloud.push_back({i % side * step, i / side % side * step, i / (side * side) * step});
    }
    return cloud;
}

// Dense clusters of very different size with single points far between.
std::vector<Vec3> uneven_cloud(std::mt19937_64& random) {
    std::vector<Vec3> cloud;
    std::normal_distribution<double> normal;
    for (int cluster = 0; cluster < 6; ++cluster) {
        const double size = std::pow(10, std::uniform_real_distribution<double>(-9, 2)(random));
        const Vec3 centre{100 * normal(random), 100 * normal(random), 100 * normal(random)};
        const std::size_t count = 1 + random() % 400;
        for (std::size_t i = 0; i < count; ++i) {
            cloud.push_back(
                centre + Vec3{size * normal(random), size * normal(random), size * normal(random)});
        }
    }
    for (int i = 0; i < 40; ++i) {
        cloud.push_back({1e6 * normal(random), 1e6 * normal(random), 1e6 * normal(random)});
    }
    return cloud;
}

// Each neighbourhood against FLANN's tree, whose answers neighbour_search_test holds against brute
// force: the same points, id by id.
void expect_neighbourhoods(const PointBlocks& points, const std::vector<std::uint8_t>& centres,
                           std::size_t k) {
    std::vector<Vec3> positions;
    for (std::size_t i = 0; i < points.size(); ++i) {
        positions.push_back(points.position(i));
    }
    const NeighbourSearch tree(positions, points.ids);
    BlockSearch search(points, centres, k);
    std::vector<Neighbour> expected;
    std::size_t found_centres = 0;
    for (std::size_t block = 0; block < points.blocks.size(); ++block) {
        const Neighbourhoods& found = search.around(block);
        for (std::size_t i = 0; i < found.count; ++i) {
            const std::uint32_t centre = found.centres[i];
            ASSERT_EQ(centres[centre], 1);
            ++found_centres;
            tree.nearest(positions[centre], points.ids[centre], k, expected);
            ASSERT_EQ(found.size, expected.size() + 1);
            // Which points they are is told by where they are: no two share a place.
            std::vector<std::array<double, 3>> places{{0, 0, 0}};
            for (const Neighbour& neighbour : expected) {
                const Vec3 offset = positions[neighbour.index] - positions[centre];
                places.push_back({offset.x, offset.y, offset.z});
            }
            const std::size_t begin = i * found.stride;
            std::vector<std::array<double, 3>> actual;
            for (std::size_t j = begin; j < begin + found.size; ++j) {
                actual.push_back({found.x[j], found.y[j], found.z[j]});
            }
            std::sort(places.begin(), places.end());
            std::sort(actual.begin(), actual.end());
            ASSERT_EQ(actual, places);
            ASSERT_EQ(found.squared_reaches[i],
                      expected.size() == k ? expected.back().squared_distance : kInfinity);
        }
    }
    ASSERT_EQ(found_centres,
              static_cast<std::size_t>(std::count(centres.begin(), centres.end(), 1)));
}

TEST(BlockSearch, EqualsTheTreeForAnyCloudAndNumberOfNeighbours) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 300; ++round) {
        const PointBlocks points = blocks_of(test::random_cloud(random));
        std::vector<std::uint8_t> centres(points.size(), 1);
        for (std::uint8_t& centre : centres) {
            centre = round % 3 == 0 || random() % 4 == 0 ? 1 : 0;
        }
        ASSERT_NO_FATAL_FAILURE(expect_neighbourhoods(points, centres, 1 + random() % 70))
            << "round " << round;
    }
}

TEST(BlockSearch, SettlesEqualDistancesById) {
    for (const int side : {2, 3, 7, 12}) {
        for (const double step : {0.1, 1.0, 1e-80, 2e-161, 3e-162, 1e-170}) {
            const PointBlocks points = blocks_of(lattice(side, step));
            const std::vector<std::uint8_t> all(points.size(), 1);
            for (const std::size_t k : {1, 5, 6, 26, 30}) {
                ASSERT_NO_FATAL_FAILURE(expect_neighbourhoods(points, all, k))
                    << side << " a side, step " << step << ", " << k << " neighbours";
            }
        }
    }
}

TEST(BlockSearch, FindsItsWayBetweenVeryDifferentDensities) {
    std::mt19937_64 random(2);
    for (int round = 0; round < 30; ++round) {
        const PointBlocks points = blocks_of(uneven_cloud(random));
        ASSERT_NO_FATAL_FAILURE(
            expect_neighbourhoods(points, std::vector<std::uint8_t>(points.size(), 1), 30))
            << "round " << round;
    }
}

TEST(BlockSearch, IsTheSameForEverySetOfInstructions) {
    std::mt19937_64 random(3);
    const PointBlocks points = blocks_of(uneven_cloud(random));
    const std::vector<std::uint8_t> all(points.size(), 1);
    int sets = 0;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        EXPECT_NO_FATAL_FAILURE(expect_neighbourhoods(points, all, 30)) << hwy::TargetName(target);
        ++sets;
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    EXPECT_GE(sets, 1);
}

}  // namespace
}  // namespace knap
