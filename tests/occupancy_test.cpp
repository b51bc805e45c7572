#include "store/occupancy.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>

#include "base/scratch.hpp"
#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"

namespace knap {
namespace {

using Counts = std::map<std::array<std::int32_t, 3>, std::uint64_t>;

constexpr std::uint64_t kAmple = std::uint64_t{64} << 20;
// What a cloud about the origin needs, whose voxels lie on both sides of every axis.
constexpr std::uint64_t kTight = 8 * 320'000;

Counts counts_of(const Occupancy& occupancy) {
    Counts counts;
    for (const Voxel& voxel : occupancy.voxels()) {
        counts[{voxel.at.x, voxel.at.y, voxel.at.z}] += voxel.points;
    }
    EXPECT_EQ(counts.size(), occupancy.voxel_count()) << "each voxel stands once";
    return counts;
}

Counts counts_by_force(const std::vector<Vec3>& points, double voxel_size) {
    Counts counts;
    for (const Vec3& p : points) {
        ++counts[{static_cast<std::int32_t>(std::floor(p.x / voxel_size)),
                  static_cast<std::int32_t>(std::floor(p.y / voxel_size)),
                  static_cast<std::int32_t>(std::floor(p.z / voxel_size))}];
    }
    return counts;
}

Occupancy filled(const std::vector<Vec3>& points, double voxel_size, std::uint64_t budget) {
    Occupancy occupancy(voxel_size, budget);
    for (const Vec3& p : points) {
        occupancy.add(p);
    }
    return occupancy;
}

// A random cloud, a voxel size and a budget that may make it coarsen.
struct Case {
    std::vector<Vec3> points;
    double voxel_size = 1;
    std::uint64_t budget = kAmple;
};

Case random_case(std::mt19937_64& random) {
    const test::Points points = test::finite_points(test::random_cloud(random));
    const double diagonal = points.box.diagonal();
    Case made;
    made.points = points.positions;
    made.voxel_size = (diagonal > 0 ? diagonal : 1) / static_cast<double>(1 + random() % 1000);
    made.budget = random() % 2 == 0 ? kAmple : kTight + random() % 200'000;
    return made;
}

TEST(VoxelIndex, IsMonotoneEverywhere) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 100000; ++round) {
        const double size = std::ldexp(1.0, static_cast<int>(random() % 40) - 20);
        const double a = std::uniform_real_distribution<double>(-1e4, 1e4)(random);
        const double b = random() % 2 == 0 ? std::nextafter(a, 1e9)
                                           : a + size * static_cast<double>(random() % 3);
        ASSERT_LE(voxel_index(a, size), voxel_index(b, size));
        ASSERT_LE(voxel_index(a, size) * size, a);
        ASSERT_GT((voxel_index(a, size) + 1) * size, a);
    }
}

TEST(Occupancy, CountsEqualThoseOfAMapAtTheVoxelSizeItEndsWith) {
    std::mt19937_64 random(2);
    for (int round = 0; round < 300; ++round) {
        const Case c = random_case(random);
        const Occupancy occupancy = filled(c.points, c.voxel_size, c.budget);
        int exponent = 0;
        ASSERT_EQ(std::frexp(occupancy.voxel_size(), &exponent), 0.5) << "a power of two";
        ASSERT_GT(2 * occupancy.voxel_size(), c.voxel_size) << "no finer than asked for";
        ASSERT_EQ(counts_of(occupancy), counts_by_force(c.points, occupancy.voxel_size()));
    }
}

TEST(Occupancy, StaysWithinItsBudgetHoweverManyVoxelsThereAre) {
    const std::vector<Vec3> points = test::sphere_cloud(20000, 3);
    for (const std::uint64_t budget : {kTight, kTight + 100'000, kTight + 1'000'000}) {
        const Occupancy occupancy = filled(points, 1e-3, budget);
        EXPECT_LE(occupancy.memory_bytes(), budget);
        EXPECT_GT(occupancy.voxel_size(), 1e-3);
        EXPECT_EQ(counts_of(occupancy), counts_by_force(points, occupancy.voxel_size()));
    }
}

TEST(Occupancy, TakesTheMemoryItSaysForADenseCloudAndForFarOutliers) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "a sanitizer keeps memory of its own";
#endif
    std::mt19937_64 random(8);
    std::vector<Vec3> outliers(2000);
    for (Vec3& p : outliers) {
        for (int axis = 0; axis < 3; ++axis) {
            p[axis] = std::uniform_real_distribution<double>(-1e6, 1e6)(random);
        }
    }
    for (const auto& points : {test::sphere_cloud(200000, 3), outliers}) {
        const std::uint64_t before = resident_bytes();
        const Occupancy occupancy = filled(points, 0.004, std::uint64_t{200} << 20);
        const auto took = static_cast<double>(resident_bytes() - before);
        const auto said = static_cast<double>(occupancy.memory_bytes());
        EXPECT_GT(said, 10e6) << "the test says something";
        // Coarsening holds two trees at a time, and the allocator keeps what it is given back.
        EXPECT_LT(took, 2.5 * said);
        EXPECT_LE(said, 200 << 20);
    }
}

TEST(Occupancy, DoesNotDependOnTheOrderOfThePoints) {
    std::mt19937_64 random(4);
    for (int round = 0; round < 200; ++round) {
        Case c = random_case(random);
        const Occupancy first = filled(c.points, c.voxel_size, c.budget);
        std::shuffle(c.points.begin(), c.points.end(), random);
        const Occupancy second = filled(c.points, c.voxel_size, c.budget);
        ASSERT_EQ(first.voxel_size(), second.voxel_size());
        const std::vector<Voxel> a = first.voxels();
        const std::vector<Voxel> b = second.voxels();
        ASSERT_TRUE(std::equal(
            a.begin(), a.end(), b.begin(), b.end(),
            [](const Voxel& v, const Voxel& w) { return v.at == w.at && v.points == w.points; }))
            << "voxels come in the same order too";
    }
}

TEST(Occupancy, OfPartsMergedEqualsThatOfTheWhole) {
    std::mt19937_64 random(5);
    for (int round = 0; round < 200; ++round) {
        const Case c = random_case(random);
        std::vector<Occupancy> parts;
        for (std::size_t i = 0; i < 1 + random() % 4; ++i) {
            parts.emplace_back(c.voxel_size, c.budget);
        }
        for (const Vec3& p : c.points) {
            parts[random() % parts.size()].add(p);
        }
        for (std::size_t i = 1; i < parts.size(); ++i) {
            parts[0].add(parts[i]);
        }
        const Occupancy whole = filled(c.points, c.voxel_size, c.budget);
        ASSERT_EQ(parts[0].voxel_size(), whole.voxel_size());
        ASSERT_EQ(counts_of(parts[0]), counts_of(whole));
    }
}

TEST(Occupancy, CoarsensUntilTheFarthestPointHasANumber) {
    const std::vector<Vec3> points{{0, 0, 0}, {1e-9, 0, 0}, {-1e15, 3, 1e14}, {1, 1, 1}};
    const Occupancy occupancy = filled(points, 1e-12, kAmple);
    EXPECT_EQ(counts_of(occupancy), counts_by_force(points, occupancy.voxel_size()));
}

TEST(Occupancy, ABoxHoldsTheVoxelsInIt) {
    std::mt19937_64 random(6);
    for (int round = 0; round < 100; ++round) {
        const Case c = random_case(random);
        const Occupancy occupancy = filled(c.points, c.voxel_size, c.budget);
        const std::vector<Voxel> all = occupancy.voxels();
        if (all.empty()) {
            continue;
        }
        const VoxelCoord a = all[random() % all.size()].at;
        const VoxelCoord b = all[random() % all.size()].at;
        const VoxelBox box{{std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)},
                           {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}};
        std::vector<VoxelCoord> expected;
        for (const Voxel& voxel : all) {
            if (box.contains(voxel.at)) {
                expected.push_back(voxel.at);
            }
        }
        std::vector<VoxelCoord> found;
        occupancy.for_each_in(box, [&](const Voxel& voxel) { found.push_back(voxel.at); });
        ASSERT_EQ(found, expected);
    }
}

TEST(Occupancy, ACubeAroundAVoxelHoldsThePointsInIt) {
    std::mt19937_64 random(7);
    for (int round = 0; round < 100; ++round) {
        const Case c = random_case(random);
        const Occupancy occupancy = filled(c.points, c.voxel_size, c.budget);
        const std::vector<Voxel> all = occupancy.voxels();
        if (all.empty()) {
            continue;
        }
        const VoxelCoord at = all[random() % all.size()].at;
        const int ring = static_cast<int>(random() % 5);
        Occupancy::Around expected;
        for (const Voxel& voxel : all) {
            bool inside = true;
            for (int axis = 0; axis < 3; ++axis) {
                inside = inside && std::abs(voxel.at[axis] - at[axis]) <= ring;
            }
            expected.points += inside ? voxel.points : 0;
            expected.voxels += inside ? 1 : 0;
        }
        const Occupancy::Around found = occupancy.around(at, ring);
        ASSERT_EQ(found.points, expected.points);
        ASSERT_EQ(found.voxels, expected.voxels);
    }
}

}  // namespace
}  // namespace knap
