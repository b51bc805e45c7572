#include "emit/lattice.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "knap/error.hpp"

namespace knap {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

SourceEntry las_source(const Vec3& scale, const Vec3& offset) {
    SourceEntry entry;
    entry.info.coordinates = {CoordinateKind::kInt32, scale, offset};
    return entry;
}

SourceEntry source_of_kind(CoordinateKind kind) {
    SourceEntry entry;
    entry.info.coordinates.kind = kind;
    return entry;
}

const Box kBox{{10, 20, -30}, {110, 220, 330}};

TEST(Lattice, IsTheScaleOfTheSourcesWhereAllShareOne) {
    const Vec3 offset{500000, 4000000, 100};
    const SourceTable table({las_source({0.01, 0.01, 0.01}, offset),
                             las_source({0.01, 0.01, 0.01}, {500123.45, 4000000, 100})},
                            kBox);
    const Lattice lattice = choose_lattice(0, table, 1.0);
    EXPECT_EQ(lattice.step, 0.01);
    EXPECT_EQ(lattice.origin, Vec3{}) << "offsets of whole steps are steps from zero";
}

TEST(Lattice, IsTheSmallestScaleWhereTheOthersAreWholeMultiples) {
    const SourceTable table({las_source({0.01, 0.01, 0.001}, {0, 0, 0}),
                             las_source({0.005, 0.005, 0.002}, {0.5, 0, 0})},
                            kBox);
    EXPECT_EQ(choose_lattice(0, table, 1.0).step, 0.001);
}

TEST(Lattice, IsAPowerOfTwoWhereTheGridsOfTheSourcesDiffer) {
    const Vec3 cm{0.01, 0.01, 0.01};
    const SourceEntry first = las_source(cm, {0, 0, 0});
    for (const SourceEntry& second :
         {las_source({0.015, 0.01, 0.01}, {0, 0, 0}), las_source(cm, {0.005, 0, 0}),
          source_of_kind(CoordinateKind::kFloat32), source_of_kind(CoordinateKind::kFloat64)}) {
        EXPECT_EQ(choose_lattice(0, SourceTable({first, second}, kBox), 1.0).step, 1.0 / 64);
    }
}

TEST(Lattice, DefaultStepIsTheLargestPowerOfTwoUpToASixtyFourthOfTheSpacing) {
    const SourceTable table({source_of_kind(CoordinateKind::kFloat32)}, kBox);
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> exponent(-10, 10);
    for (int i = 0; i < 1000; ++i) {
        const double spacing = std::pow(10, exponent(random));
        const Lattice lattice = choose_lattice(0, table, spacing);
        int ignored = 0;
        EXPECT_EQ(std::frexp(lattice.step, &ignored), 0.5);
        EXPECT_LE(lattice.step, spacing / 64);
        EXPECT_GT(lattice.step * 2, spacing / 64);
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_LE(lattice.origin[axis], kBox.min[axis]);
            EXPECT_GT(lattice.origin[axis] + lattice.step, kBox.min[axis]);
            EXPECT_EQ(std::remainder(lattice.origin[axis], lattice.step), 0);
        }
    }
}

TEST(Lattice, GivesBackEveryCoordinateOfALasFileBitForBit) {
    const Vec3 scale{0.00025, 0.00025, 0.00025};
    const Vec3 offset{500000, 4000000, 1000};
    std::mt19937_64 random(2);
    std::uniform_int_distribution<std::int32_t> native(std::numeric_limits<std::int32_t>::min(),
                                                       std::numeric_limits<std::int32_t>::max());
    const SourceTable table({las_source(scale, offset)}, kBox);
    const Lattice lattice = choose_lattice(0, table, 0.5);
    for (int i = 0; i < 100000; ++i) {
        Vec3 position;
        for (int axis = 0; axis < 3; ++axis) {
            position[axis] = GridAxis(scale[axis], offset[axis]).at(native(random));
        }
        ASSERT_EQ(position_of(lattice, index_of(lattice, position)), position);
    }
}

TEST(Lattice, KeepsEveryPositionWithinHalfAStep) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> unit(0, 1);
    const SourceTable table({source_of_kind(CoordinateKind::kFloat64)}, kBox);
    for (const double step : {0.0, 0.1, 0.003, 1.0 / 3}) {
        const Lattice lattice = choose_lattice(step, table, 0.25);
        for (int i = 0; i < 10000; ++i) {
            Vec3 position;
            for (int axis = 0; axis < 3; ++axis) {
                position[axis] = kBox.min[axis] + unit(random) * kBox.size()[axis];
            }
            const Vec3 moved = position_of(lattice, index_of(lattice, position));
            for (int axis = 0; axis < 3; ++axis) {
                // Beside the half step, some roundings of doubles below 512 in magnitude.
                ASSERT_LE(std::abs(moved[axis] - position[axis]), lattice.step / 2 + 4 * 0x1p-44);
            }
        }
    }
}

TEST(Lattice, ASinglePointIsExactAndAnEmptyCloudHasALattice) {
    Box point;
    point.extend(Vec3{0.1, -1e7 / 3, 2});
    const SourceEntry source = source_of_kind(CoordinateKind::kFloat64);
    const Lattice lattice = choose_lattice(0, SourceTable({source}, point), 0);
    EXPECT_EQ(position_of(lattice, index_of(lattice, point.min)), point.min);
    EXPECT_GT(choose_lattice(0, SourceTable({source}, Box{}), 0).step, 0);
    EXPECT_GT(choose_lattice(0, SourceTable({source}, kBox), 0).step, 0);
}

TEST(Lattice, AGivenStepIsTakenAndStaysOnTheGridOfTheSources) {
    const Vec3 offset{0.123, 4, 5};
    const SourceTable table({las_source({0.01, 0.01, 0.01}, offset)}, kBox);
    const Lattice lattice = choose_lattice(0.02, table, 1.0);
    EXPECT_EQ(lattice.step, 0.02);
    EXPECT_EQ(lattice.origin, (Vec3{0.123, 0, 0})) << "4 and 5 are whole steps from zero";
}

TEST(Lattice, AStepTooSmallForTheBoxIsAnErrorNamingTheKey) {
    const SourceTable table({source_of_kind(CoordinateKind::kFloat64)}, kBox);
    for (const double step : {1e-14, 1e-29, 1e-40, 1e35}) {
        EXPECT_THAT([&] { choose_lattice(step, table, 1.0); },
                    ThrowsMessage<ConfigError>(HasSubstr("output.step")))
            << step;
    }
}

}  // namespace
}  // namespace knap
