#include "surface/triangle.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace knap {
namespace {

// The least over a fine lattice of the triangle's points: never below, and little above.
double by_sampling(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    constexpr int kSteps = 200;
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= kSteps; ++i) {
        for (int j = 0; i + j <= kSteps; ++j) {
            const double v = static_cast<double>(i) / kSteps;
            const double w = static_cast<double>(j) / kSteps;
            const double u = 1 - v - w;
            best = std::min(
                best, squared_distance(p, {u * a.x + v * b.x + w * c.x, u * a.y + v * b.y + w * c.y,
                                           u * a.z + v * b.z + w * c.z}));
        }
    }
    return best;
}

TEST(Triangle, DistanceIsThatToItsNearestPoint) {
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    const auto any = [&] { return Vec3{normal(random), normal(random), normal(random)}; };
    for (int round = 0; round < 300; ++round) {
        const Vec3 a = any();
        const Vec3 b = any();
        // Now and then without an area.
        const Vec3 c = round % 10 == 0 ? a : round % 11 == 0 ? Vec3{a.x, b.y, a.z} : any();
        const Vec3 p = any();
        const double found = std::sqrt(squared_distance_to_triangle(p, a, b, c));
        const double sampled = std::sqrt(by_sampling(p, a, b, c));
        ASSERT_LE(found, sampled + 1e-12);
        ASSERT_GE(found, sampled - 0.05);
    }
}

TEST(Triangle, InOnePlaceIsAPoint) {
    const Vec3 a{1, 2, 3};
    EXPECT_EQ(squared_distance_to_triangle({1, 2, 5}, a, a, a), 4);
}

}  // namespace
}  // namespace knap
