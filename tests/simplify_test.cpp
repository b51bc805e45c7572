#include "knap/simplify.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace knap
