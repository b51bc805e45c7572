#include "knap/geometry.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace knap {
namespace {

class BoxDistance : public testing::Test {
  protected:
    Vec3 point() {
        std::uniform_real_distribution<double> uniform(-1, 1);
        return {uniform(random_), uniform(random_), uniform(random_)};
    }

    std::mt19937_64 random_{3};
};

TEST_F(BoxDistance, IsNoLongerThanThatOfAnyPointsInside) {
    for (int round = 0; round < 10000; ++round) {
        const Vec3 p = point();
        const Vec3 q = point();
        Box a;
        Box b;
        a.extend(p);
        b.extend(q);
        ASSERT_EQ(a.squared_distance_to(b), squared_distance(p, q)) << "of points: bit for bit";
        ASSERT_EQ(a.squared_distance_to(q), squared_distance(p, q));
        a.extend(point());
        b.extend(point());
        ASSERT_LE(a.squared_distance_to(b), squared_distance(p, q));
        ASSERT_LE(a.squared_distance_to(b), a.squared_distance_to(q));
        ASSERT_EQ(a.squared_distance_to(b), b.squared_distance_to(a));
    }
}

TEST_F(BoxDistance, IsZeroWhereTheyOverlapAndInfiniteToNothing) {
    Box a;
    EXPECT_EQ(a.squared_distance_to(Vec3{}), std::numeric_limits<double>::infinity());
    a.extend(Vec3{-1, -1, -1});
    a.extend(Vec3{1, 1, 1});
    EXPECT_EQ(a.squared_distance_to(Vec3{0.5, -1, 1}), 0);
    EXPECT_EQ(a.squared_distance_to(Box{}), std::numeric_limits<double>::infinity());
    EXPECT_EQ(Box{}.squared_distance_to(a), std::numeric_limits<double>::infinity());
    Box b = a;
    b.extend(Vec3{5, 5, 5});
    EXPECT_EQ(a.squared_distance_to(b), 0);
    Box beside;
    beside.extend(Vec3{3, 0, 0});
    beside.extend(Vec3{4, 0, 0});
    EXPECT_EQ(a.squared_distance_to(beside), 4);
}

}  // namespace
}  // namespace knap
