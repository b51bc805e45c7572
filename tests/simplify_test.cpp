#include "knap/simplify.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "knap/error.hpp"
#include "support/clouds.hpp"
#include "support/random_params.hpp"
#include "support/reference.hpp"

namespace knap {
namespace {

TEST(Simplify, EqualsTheBruteForceReferenceFor500RandomClouds) {
    std::mt19937_64 random(2015);
    for (int round = 0; round < 500; ++round) {
        const std::vector<Vec3> cloud = test::random_cloud(random);
        const SimplifyParams params = test::random_params(random, cloud);
        const reference::Result expected =
            reference::simplify(cloud, params.curvature, params.range);
        const SimplifyResult result = simplify(cloud, params);
        ASSERT_EQ(result.kept, expected.kept)
            << "round " << round << ", " << cloud.size() << " points";
        EXPECT_EQ(result.counts.merged, expected.merged);
        EXPECT_EQ(result.counts.rejected, expected.rejected);
        EXPECT_EQ(result.counts.represented, expected.represented);
        EXPECT_EQ(result.spacing, expected.spacing);
        EXPECT_EQ(result.mean_curvature, expected.mean_curvature);
    }
}

TEST(Simplify, KeepsNothingOfNothing) {
    SimplifyParams params;
    params.range.alpha = 1;
    EXPECT_EQ(simplify({}, params).counts, Counts{});
}

TEST(Simplify, KeepsOnePoint) {
    SimplifyParams params;
    params.range.alpha = 1;
    const std::vector<Vec3> one{{1, 2, 3}};
    EXPECT_EQ(simplify(one, params).kept, std::vector<PointId>{0});
}

TEST(Simplify, RejectsAllNonFinitePointsAndCountsThem) {
    SimplifyParams params;
    params.range.alpha = 1;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const std::vector<Vec3> cloud{
        {nan, 0, 0}, {0, nan, 0}, {0, 0, -std::numeric_limits<double>::infinity()}};
    const SimplifyResult result = simplify(cloud, params);
    EXPECT_TRUE(result.kept.empty());
    EXPECT_EQ(result.counts, (Counts{.in = 3, .rejected = 3}));
}

TEST(Simplify, CountsAddUp) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 50; ++round) {
        const std::vector<Vec3> cloud = test::random_cloud(random);
        const Counts counts = simplify(cloud, test::random_params(random, cloud)).counts;
        EXPECT_EQ(counts.in, counts.kept + counts.represented + counts.merged + counts.rejected);
    }
}

TEST(Simplify, DoesNotDependOnThreads) {
    const std::vector<Vec3> cloud = test::sphere_cloud(20000, 7);
    SimplifyParams params;
    params.range.alpha = 0.03;
    params.threads = 1;
    const std::vector<PointId> one = simplify(cloud, params).kept;
    params.threads = 4;
    EXPECT_EQ(simplify(cloud, params).kept, one);
}

TEST(Simplify, RefusesParametersOutOfRange) {
    const std::vector<Vec3> cloud{{0, 0, 0}};
    SimplifyParams params;
    EXPECT_THROW(simplify(cloud, params), ConfigError) << "alpha missing";
    params.range.alpha = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(simplify(cloud, params), ConfigError);
    params.range.alpha = -1;
    EXPECT_THROW(simplify(cloud, params), ConfigError);
}

TEST(Simplify, RefusesDistancesThatOverflow) {
    const std::vector<Vec3> cloud{{-1e200, 0, 0}, {1e200, 0, 0}};
    SimplifyParams params;
    params.range.alpha = 1;
    EXPECT_THROW(simplify(cloud, params), InputError);
}

// Two equal arcs of 20 units, 1 unit apart in the middle, that meet in sharp edges; 12 units long.
// Even places are above, odd ones below.
std::vector<Vec3> blade(std::size_t points) {
    constexpr double kRadius = 100.25;
    std::mt19937_64 random(31);
    std::uniform_real_distribution<double> along(0, 12);
    std::uniform_real_distribution<double> across(-10, 10);
    std::vector<Vec3> cloud(points);
    for (std::size_t i = 0; i < points; ++i) {
        const double x = across(random);
        const double z = std::sqrt(kRadius * kRadius - x * x) - (kRadius - 0.5);
        cloud[i] = {x, along(random), i % 2 == 0 ? z : -z};
    }
    return cloud;
}

// Points that no kept point of their own side stands within the largest range of.
std::size_t in_holes(const std::vector<Vec3>& cloud, const SimplifyParams& params,
                     double thinnest) {
    const std::vector<PointId> kept = simplify(cloud, params).kept;
    const double largest = params.range.alpha * params.range.max_factor;
    std::size_t holes = 0;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
        const bool held = std::any_of(kept.begin(), kept.end(), [&](PointId id) {
            return id % 2 == i % 2 && squared_distance(cloud[id], cloud[i]) <= largest * largest;
        });
        holes += !held && 2 * std::abs(cloud[i].z) > thinnest ? 1 : 0;
    }
    return holes;
}

TEST(Simplify, WithASlabLeavesNoHoleOnEitherSideOfABlade) {
    const std::vector<Vec3> cloud = blade(12000);
    SimplifyParams params;
    params.range.alpha = 0.3;
    for (const Estimator estimator : {Estimator::kFourier, Estimator::kQuadric}) {
        params.curvature.estimator = estimator;
        params.range.slab = 0;
        EXPECT_GT(in_holes(cloud, params, 0), 100U) << "ranges reach through the blade";
        params.range.slab = 0.1;
        // Thinner than the slab of the largest range, and of what the surface bends in it, one side
        // may stand for the other.
        const double largest = params.range.alpha * params.range.max_factor;
        EXPECT_EQ(in_holes(cloud, params, 2 * params.range.slab * largest), 0U);
    }
}

}  // namespace
}  // namespace knap
