#include "store/source_table.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

namespace knap {
namespace {

SourceEntry source(CoordinateKind kind, std::uint64_t points, const Vec3& scale = {1, 1, 1},
                   const Vec3& offset = {0, 0, 0}) {
    SourceEntry entry;
    entry.points = points;
    entry.info.coordinates = {kind, scale, offset};
    return entry;
}

void expect_survives(const SourceTable& table, std::size_t index, const Vec3& position) {
    std::array<std::byte, 24> packed;
    table.pack(index, position, packed.data());
    const Vec3 unpacked = table.unpack(index, packed.data());
    for (int axis = 0; axis < 3; ++axis) {
        ASSERT_EQ(std::bit_cast<std::uint64_t>(unpacked[axis]),
                  std::bit_cast<std::uint64_t>(position[axis]))
            << position[axis];
    }
}

TEST(SourceTable, FloatsSurviveBitForBit) {
    const SourceTable table({source(CoordinateKind::kFloat32, 1)}, {});
    EXPECT_EQ(table.packed_size(), 12U);
    expect_survives(table, 0, {-0.0, 0.0, std::numeric_limits<float>::denorm_min()});
    std::mt19937 random(1);
    for (int i = 0; i < 100000; ++i) {
        const auto any = [&] {
            const auto value = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
            return std::isfinite(value) ? static_cast<double>(value) : 0.0;
        };
        expect_survives(table, 0, {any(), any(), any()});
    }
}

TEST(SourceTable, LasCoordinatesSurviveBitForBit) {
    std::mt19937_64 random(2);
    constexpr std::int32_t kLow = std::numeric_limits<std::int32_t>::min();
    constexpr std::int32_t kHigh = std::numeric_limits<std::int32_t>::max();
    std::uniform_int_distribution<std::int32_t> native(kLow, kHigh);
    const Vec3 scale{0.00025, 0.01, 1e-7};
    const Vec3 offset{500000, -4000000.1, 0.3};
    const SourceTable table({source(CoordinateKind::kInt32, 1, scale, offset)}, {});
    EXPECT_EQ(table.packed_size(), 12U);
    const auto position = [&](std::int32_t x, std::int32_t y, std::int32_t z) {
        return Vec3{GridAxis(scale.x, offset.x).at(x), GridAxis(scale.y, offset.y).at(y),
                    GridAxis(scale.z, offset.z).at(z)};
    };
    expect_survives(table, 0, position(kLow, kHigh, 0));
    expect_survives(table, 0, position(kHigh, kLow, -1));
    for (int i = 0; i < 100000; ++i) {
        expect_survives(table, 0, position(native(random), native(random), native(random)));
    }
}

TEST(SourceTable, OneSourceOfDoublesMakesAllRecordsWide) {
    const SourceTable table({source(CoordinateKind::kInt32, 1, {0.01, 0.01, 0.01}),
                             source(CoordinateKind::kFloat64, 1)},
                            {});
    EXPECT_TRUE(table.wide());
    EXPECT_EQ(table.packed_size(), 24U);
    expect_survives(table, 0, {0.01 * 7, -0.0, 1});
    expect_survives(table, 1, {1.0 / 3, 1e300, -0.0});
}

TEST(SourceTable, EveryIdBelongsToTheSourceThatHoldsIt) {
    std::mt19937_64 random(3);
    for (int round = 0; round < 100; ++round) {
        std::vector<SourceEntry> entries;
        std::vector<std::size_t> owners;
        for (std::size_t i = 0; i < 1 + random() % 10; ++i) {
            const std::uint64_t points = random() % 4;
            entries.push_back(source(CoordinateKind::kFloat32, points));
            entries.back().rejected = points / 2;
            owners.insert(owners.end(), points, i);
        }
        const SourceTable table(entries, {});
        ASSERT_EQ(table.points(), owners.size());
        for (PointId id = 0; id < owners.size(); ++id) {
            EXPECT_EQ(table.source_of(id), owners[id]);
            EXPECT_GE(id, table.sources()[owners[id]].first_id);
        }
    }
}

}  // namespace
}  // namespace knap
