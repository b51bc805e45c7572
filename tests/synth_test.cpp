#include "app/synth.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <tuple>
#include <vector>

#include "app/synth_writer.hpp"
#include "base/threads.hpp"
#include "support/clouds.hpp"

namespace knap::app {

void PrintTo(Shape shape, std::ostream* out) {
    *out << static_cast<int>(shape);
}

namespace {

constexpr double kPi = std::numbers::pi;

std::vector<Vec3> cloud_of(const SynthParams& params) {
    std::vector<Vec3> points(params.points);
    SynthCloud(params).fill(0, points);
    return points;
}

double distance(const Vec3& a, const Vec3& b) {
    return std::sqrt(squared_distance(a, b));
}

Box box_of(const std::vector<Vec3>& points) {
    Box box;
    for (const Vec3& p : points) {
        box.extend(p);
    }
    return box;
}

/// Height of the flake's ventral face.
double ventral(const Vec3& p) {
    return 3.5 * (p.x * p.x / (29.5 * 29.5) + p.y * p.y / (16 * 16) - 1);
}

class EveryShape : public testing::TestWithParam<Shape> {};
INSTANTIATE_TEST_SUITE_P(Synth, EveryShape,
                         testing::Values(Shape::kFlake, Shape::kSphere, Shape::kTorus,
                                         Shape::kBlade, Shape::kTerrain));

TEST_P(EveryShape, AnyNumberOfPointsWorks) {
    for (const std::uint64_t n : {0, 1, 2, 17, 1000, 100'003}) {
        const std::vector<Vec3> points = cloud_of({GetParam(), n, 1, 0.001});
        EXPECT_TRUE(std::all_of(points.begin(), points.end(), is_finite)) << n;
        EXPECT_EQ(std::count(points.begin(), points.end(), Vec3{}), 0) << n;
    }
}

TEST_P(EveryShape, TheSameWhateverTheBlocks) {
    const SynthParams params{GetParam(), 20'011, 5, 0.001};
    const std::vector<Vec3> whole = cloud_of(params);
    const SynthCloud cloud(params);
    std::mt19937 random(1);
    for (int i = 0; i < 200; ++i) {
        const std::uint64_t first = random() % params.points;
        std::vector<Vec3> part(random() % std::min<std::uint64_t>(params.points - first, 500) + 1);
        cloud.fill(first, part);
        EXPECT_TRUE(std::equal(part.begin(), part.end(),
                               whole.begin() + static_cast<std::ptrdiff_t>(first)));
    }
}

TEST_P(EveryShape, TheSeedChangesIt) {
    const std::vector<Vec3> one = cloud_of({GetParam(), 1000, 1, 0});
    EXPECT_EQ(one, cloud_of({GetParam(), 1000, 1, 0}));
    const std::vector<Vec3> two = cloud_of({GetParam(), 1000, 2, 0});
    for (std::size_t i = 0; i < one.size(); ++i) {
        EXPECT_NE(one[i], two[i]);
    }
}

TEST_P(EveryShape, NoiseMovesAPointByNoMoreThanItself) {
    const double noise = 0.01;
    const std::vector<Vec3> exact = cloud_of({GetParam(), 10'000, 1, 0});
    const std::vector<Vec3> noisy = cloud_of({GetParam(), 10'000, 1, noise});
    double largest = 0;
    for (std::size_t i = 0; i < exact.size(); ++i) {
        largest = std::max(largest, distance(exact[i], noisy[i]));
    }
    EXPECT_LE(largest, noise * (1 + 1e-9));
    EXPECT_GT(largest, noise / 2);
}

TEST_P(EveryShape, NoTwoPointsCoincideAsFloats) {
    std::vector<std::tuple<float, float, float>> stored;
    for (const Vec3& p : cloud_of({GetParam(), 300'000, 3, 0})) {
        stored.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y),
                            static_cast<float>(p.z));
    }
    std::sort(stored.begin(), stored.end());
    EXPECT_EQ(std::adjacent_find(stored.begin(), stored.end()), stored.end());
}

// A scanner's order: the next point of a strip is the next cell. The cells are about square; where
// they are not, at the poles and on steep ground, they are longer by a small factor.
TEST_P(EveryShape, NeighboursInTheStreamAreNeighboursInSpace) {
    const std::vector<Vec3> points = cloud_of({GetParam(), 100'000, 1, 0});
    const double extent = box_of(points).diagonal();
    std::size_t near = 0;
    for (std::size_t i = 1; i < points.size(); ++i) {
        near += distance(points[i - 1], points[i]) < extent / 50 ? 1 : 0;
    }
    // All but the ends of the strips, of which there are less than 4 sqrt(n).
    EXPECT_GT(near, points.size() - 4 * 317);
}

TEST(Synth, SpherePointsLieOnTheSphere) {
    for (const Vec3& p : cloud_of({Shape::kSphere, 10'000, 1, 0})) {
        EXPECT_NEAR(distance(p, {}), 1, 1e-14);
    }
}

TEST(Synth, TorusPointsLieOnTheTorus) {
    for (const Vec3& p : cloud_of({Shape::kTorus, 10'000, 1, 0})) {
        EXPECT_NEAR(std::hypot(std::hypot(p.x, p.y) - 1, p.z), 0.35, 1e-14);
    }
}

TEST(Synth, SphereIsEvenInArea) {
    constexpr int kBands = 8;
    constexpr std::uint64_t kPoints = 200'000;
    std::map<int, int> counts;
    for (const Vec3& p : cloud_of({Shape::kSphere, kPoints, 1, 0})) {
        const int band = std::min(kBands - 1, static_cast<int>((p.z + 1) / 2 * kBands));
        const int sector = std::min(
            kBands - 1, static_cast<int>((std::atan2(p.y, p.x) + kPi) / (2 * kPi) * kBands));
        ++counts[band * kBands + sector];
    }
    // One point a cell: a patch can be wrong only by the cells on its border, which is at most
    // 2 pi / 8 long at each of two sides and, near the pole, arccos(3/4) at the others.
    const double side = std::sqrt(4 * kPi / kPoints);
    const double border = 2 * (2 * kPi / kBands + std::acos(1 - 2.0 / kBands)) / side;
    ASSERT_EQ(counts.size(), kBands * kBands);
    for (const auto& [patch, count] : counts) {
        EXPECT_NEAR(count, static_cast<double>(kPoints) / (kBands * kBands), border) << patch;
    }
}

TEST(Synth, TorusIsEvenInArea) {
    constexpr int kBands = 12;
    constexpr std::uint64_t kPoints = 200'000;
    std::vector<double> counts(kBands);
    for (const Vec3& p : cloud_of({Shape::kTorus, kPoints, 1, 0})) {
        const double angle = std::atan2(p.z, std::hypot(p.x, p.y) - 1) + kPi;
        ++counts[static_cast<std::size_t>(std::min(kBands - 1.0, angle / (2 * kPi) * kBands))];
    }
    const double area = 4 * kPi * kPi * 0.35;
    const double side = std::sqrt(area / kPoints);
    for (int i = 0; i < kBands; ++i) {
        const double low = 2 * kPi * i / kBands - kPi;
        const double high = 2 * kPi * (i + 1) / kBands - kPi;
        const double band = 2 * kPi * 0.35 * (high - low + 0.35 * (std::sin(high) - std::sin(low)));
        // Wrong only by the cells of one ring at each of the two borders.
        const double border = 2 * 2 * kPi * 1.35 / side;
        EXPECT_NEAR(counts[static_cast<std::size_t>(i)], kPoints * band / area, border) << i;
    }
}

TEST(Synth, BladePointsLieOnTwoArcsThatMeetInSharpEdges) {
    constexpr double kRadius = 100.25;
    const std::vector<Vec3> points = cloud_of({Shape::kBlade, 50'000, 1, 0});
    std::size_t upper = 0;
    double thickest = 0;
    double near_edge = 0;
    for (const Vec3& p : points) {
        const double thickness = 2 * (std::sqrt(kRadius * kRadius - p.x * p.x) - kRadius) + 1;
        ASSERT_NEAR(2 * std::abs(p.z), thickness, 1e-9);
        upper += p.z > 0 ? 1 : 0;
        thickest = std::max(thickest, thickness);
        near_edge = std::max(near_edge, std::abs(p.x));
    }
    EXPECT_NEAR(static_cast<double>(upper), 25'000, 1);
    EXPECT_NEAR(thickest, 1, 1e-3);
    EXPECT_GT(near_edge, 9.9);
    const Vec3 size = box_of(points).size();
    EXPECT_NEAR(size.x, 20, 0.1);
    EXPECT_NEAR(size.y, 60, 0.2);
}

TEST(Synth, BladeIsEvenInArea) {
    // By stretches along it and by arcs of both sides: twenty by five.
    std::map<std::tuple<int, int, bool>, int> cells;
    constexpr int kPoints = 200'000;
    for (const Vec3& p : cloud_of({Shape::kBlade, kPoints, 1, 0})) {
        const double share = std::asin(p.x / 100.25) / std::asin(10 / 100.25);
        ++cells[{std::min(19, static_cast<int>(p.y / 3)),
                 std::min(4, static_cast<int>((share + 1) * 2.5)), p.z > 0}];
    }
    ASSERT_EQ(cells.size(), 200U);
    for (const auto& [cell, count] : cells) {
        EXPECT_NEAR(count, kPoints / 200, 60);
    }
}

TEST(Synth, TerrainIsEvenInPlan) {
    constexpr std::size_t kTiles = 10;
    constexpr std::uint64_t kPoints = 250'000;
    std::vector<int> counts(kTiles * kTiles);
    for (const Vec3& p : cloud_of({Shape::kTerrain, kPoints, 1, 0})) {
        ++counts[static_cast<std::size_t>(p.y / 100) * kTiles +
                 static_cast<std::size_t>(p.x / 100)];
    }
    // 500 strips of 500 cells: a tile of 50 x 50 is wrong only by the cells on its border.
    for (const int count : counts) {
        EXPECT_NEAR(count, 2500, 4 * 50);
    }
}

TEST(Synth, FlakeIsAThinClosedBodyOfItsSize) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        const std::vector<Vec3> points = cloud_of({Shape::kFlake, 50'000, seed, 0});
        const Vec3 size = box_of(points).size();
        EXPECT_NEAR(size.x, 60, 6) << seed;
        EXPECT_NEAR(size.y, 35, 4) << seed;
        EXPECT_NEAR(size.z, 10, 1.5) << seed;
        std::size_t below = 0;
        for (const Vec3& p : points) {
            // The outline is a polygon of 65,536 corners: it can cut off less than this.
            EXPECT_GE(p.z, ventral(p) - 0.01) << seed;
            below += p.z < ventral(p) + 1e-9 ? 1 : 0;
        }
        EXPECT_NEAR(static_cast<double>(below), 25'000, 2'500) << "both faces are seen: " << seed;
    }
}

TEST(Synth, FlakeEndsInASharpEdge) {
    // Along the edge the two faces come together: the last ring of the back and the first ring of
    // the ventral face, one cell apart, are also less than two cells apart in height.
    const std::uint64_t n = 200'000;
    const std::vector<Vec3> points = cloud_of({Shape::kFlake, n, 1, 0});
    const double side = std::sqrt(3300.0 / static_cast<double>(n));
    const auto first_below = static_cast<std::size_t>(
        std::find_if(points.begin(), points.end(),
                     [](const Vec3& p) { return p.z < ventral(p) + 1e-9; }) -
        points.begin());
    for (std::size_t i = first_below - 500; i < first_below; ++i) {
        EXPECT_LT(points[i].z - ventral(points[i]), 2 * side) << i;
    }
}

TEST(Synth, FlakeIsEvenInArea) {
    constexpr std::uint64_t kPoints = 400'000;
    const std::vector<Vec3> points = cloud_of({Shape::kFlake, kPoints, 1, 0});
    // Patches of 5 x 5 mm of the ventral face, whose area is known.
    std::vector<double> densities;
    double cells = 0;
    for (const double left : {-20.0, -10.0, 0.0, 10.0, 15.0}) {
        for (const double low : {-7.5, -2.5, 2.5}) {
            const auto count = std::count_if(points.begin(), points.end(), [&](const Vec3& p) {
                return p.x >= left && p.x < left + 5 && p.y >= low && p.y < low + 5 &&
                       p.z < ventral(p) + 1e-9;
            });
            double area = 0;
            constexpr int kSteps = 50;
            for (int i = 0; i < kSteps * kSteps; ++i) {
                const double x = left + 5 * (i % kSteps + 0.5) / kSteps;
                const double y = low + 5 * (i / kSteps + 0.5) / kSteps;
                area += std::hypot(1, std::hypot(7 * x / (29.5 * 29.5), 7 * y / 256)) * 25 /
                        (kSteps * kSteps);
            }
            densities.push_back(static_cast<double>(count) / area);
            cells = std::max(cells, static_cast<double>(count));
        }
    }
    // A patch of c cells is wrong by those on its border, 4 sqrt(c) at most; that is what two
    // densities may differ by on either side. Along a ring the area is known by 256 steps, within
    // which the outline changes by a few percent.
    const auto [least, most] = std::minmax_element(densities.begin(), densities.end());
    EXPECT_LT(*most / *least, (1 + 4 / std::sqrt(cells)) / (1 - 4 / std::sqrt(cells)) * 1.05);
}

TEST(SynthWriter, WritesWhatWasMadeForAnyThreadCount) {
    const test::TemporaryFolder folder;
    const SynthParams params{Shape::kFlake, 100'003, 1, 0.001};
    const std::vector<Vec3> points = cloud_of(params);
    for (const int threads : {1, 4}) {
        const ThreadLimit limit(threads);
        for (const char* name : {"cloud.ply", "cloud.xyz"}) {
            write_cloud(SynthCloud(params), params.points, folder / name);
            const std::vector<Vec3> read = test::read_cloud(folder / name);
            ASSERT_EQ(read.size(), points.size()) << name;
            for (std::size_t i = 0; i < read.size(); ++i) {
                // Text is read as the double nearest to the digits, which name one float.
                ASSERT_EQ(static_cast<float>(read[i].x), static_cast<float>(points[i].x)) << name;
                ASSERT_EQ(static_cast<float>(read[i].y), static_cast<float>(points[i].y)) << name;
                ASSERT_EQ(static_cast<float>(read[i].z), static_cast<float>(points[i].z)) << name;
            }
        }
    }
}

}  // namespace
}  // namespace knap::app
