#include "store/local_frame.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "base/vector.hpp"

namespace knap {
namespace {

Vec3 scaled_to_one(const Vec3& v) {
    const double length = std::sqrt(dot(v, v));
    return {v.x / length, v.y / length, v.z / length};
}

Vec3 random_direction(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    return scaled_to_one({normal(random), normal(random), normal(random)});
}

// The part of v at right angles to the normal.
Vec3 tangent(const Vec3& v, const Vec3& normal) {
    const double along = dot(v, normal);
    return scaled_to_one({v.x - along * normal.x, v.y - along * normal.y, v.z - along * normal.z});
}

TEST(PackedFrame, IsOffByNoMoreThanItSays) {
    std::mt19937_64 random(1);
    const double degree = std::numbers::pi / 180;
    for (int round = 0; round < 100000; ++round) {
        LocalFrame frame;
        frame.normal = random_direction(random);
        frame.flattest = tangent(random_direction(random), frame.normal);
        frame.flatness = 1 + 3 * std::uniform_real_distribution<double>(0, 1)(random);
        const LocalFrame found = PackedFrame(frame).frame();
        ASSERT_GT(dot(found.normal, frame.normal), std::cos(degree));
        // Half of a step of the diamond's longest, and what the normal's rounding turns.
        ASSERT_GT(std::abs(dot(found.flattest, frame.flattest)), std::cos(8.5 * degree));
        ASSERT_NEAR(found.flatness, frame.flatness, 0.1 + 1e-12);
        ASSERT_NEAR(dot(found.normal, found.normal), 1, 1e-14);
        ASSERT_NEAR(dot(found.flattest, found.flattest), 1, 1e-14);
        ASSERT_NEAR(dot(found.steepest, found.steepest), 1, 1e-14);
        ASSERT_NEAR(dot(found.normal, found.flattest), 0, 1e-14);
    }
}

TEST(PackedFrame, KeepsTheAxesAndTheirOpposites) {
    for (int axis = 0; axis < 3; ++axis) {
        for (const double sign : {1.0, -1.0}) {
            LocalFrame frame;
            frame.normal[axis] = sign;
            frame.flattest[(axis + 1) % 3] = 1;
            frame.flatness = std::numeric_limits<double>::infinity();
            const LocalFrame found = PackedFrame(frame).frame();
            EXPECT_EQ(found.normal, frame.normal);
            EXPECT_NEAR(std::abs(dot(found.flattest, frame.flattest)), 1, 1e-12);
            EXPECT_EQ(found.flatness, 4);
        }
    }
}

TEST(PackedFrame, OfWhatItHoldsIsTheSame) {
    std::mt19937_64 random(2);
    for (int round = 0; round < 100000; ++round) {
        LocalFrame frame;
        frame.normal = random_direction(random);
        frame.flattest = tangent(random_direction(random), frame.normal);
        const PackedFrame packed(frame);
        ASSERT_FALSE(packed.is_none());
        ASSERT_EQ(PackedFrame(packed.frame()), packed);
    }
    EXPECT_TRUE(PackedFrame().is_none());
}

}  // namespace
}  // namespace knap
