#include "merge/region.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace knap {
namespace {

// Bends towards +z, flattest along x.
PackedFrame upright(double flatness) {
    LocalFrame frame;
    frame.normal = {0, 0, 1};
    frame.flattest = {1, 0, 0};
    frame.flatness = flatness;
    return PackedFrame(frame);
}

RegionShape shape_of(double slab, double aspect) {
    RangeParams range;
    range.slab = slab;
    range.aspect = aspect;
    return RegionShape(range);
}

TEST(Region, OfASlabHoldsThePointsNearTheOsculatingSphereOnly) {
    const Region region{1, 1, 0.5, upright(1)};
    const RegionShape shape = shape_of(0.1, 1);
    EXPECT_TRUE(holds(region, shape, {0, 0, 0.09}));
    EXPECT_FALSE(holds(region, shape, {0, 0, 0.11}));
    EXPECT_FALSE(holds(region, shape, {0, 0, -0.11}));
    // At 0.8 the sphere is 0.5 * 0.64 / 2 = 0.16 above the tangent plane.
    EXPECT_FALSE(holds(region, shape, {0.8, 0, 0.05}));
    EXPECT_TRUE(holds(region, shape, {0.8, 0, 0.07}));
    EXPECT_TRUE(holds(region, shape, {0, -0.8, 0.25}));
    EXPECT_FALSE(holds(region, shape, {0, -0.8, 0.27}));
}

TEST(Region, OfAnAspectIsAsLongAsTheFlatnessAllowsAtEqualArea) {
    const Region region{1, 2, 0, upright(4)};
    const RegionShape wide = shape_of(0, 4);
    EXPECT_TRUE(holds(region, wide, {1.99, 0, 0}));
    EXPECT_FALSE(holds(region, wide, {2.01, 0, 0}));
    EXPECT_TRUE(holds(region, wide, {0, 0.49, 0}));
    EXPECT_FALSE(holds(region, wide, {0, 0.51, 0}));
    const RegionShape narrow = shape_of(0, 2.25);
    EXPECT_TRUE(holds(region, narrow, {1.49, 0, 0}));
    EXPECT_FALSE(holds(region, narrow, {1.51, 0, 0}));
    EXPECT_TRUE(holds(region, narrow, {0, 0.66, 0}));
    EXPECT_FALSE(holds(region, narrow, {0, 0.67, 0}));
}

TEST(Region, WithoutAFrameIsABall) {
    const Region region{1, 1, 3, PackedFrame()};
    EXPECT_TRUE(holds(region, shape_of(0.01, 4), {0, 0, 0.99}));
}

TEST(Region, OfAnInfiniteRangeHoldsEverything) {
    const double infinity = std::numeric_limits<double>::infinity();
    const Region region{infinity, infinity, 0, upright(3)};
    EXPECT_TRUE(holds(region, shape_of(0.2, 4), {1e9, -1e9, 1e9}));
}

}  // namespace
}  // namespace knap
