#include "emit/tile_layout.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "emit/draco_tile.hpp"
#include "emit/tiles.hpp"
#include "knap/error.hpp"
#include "support/attribute_cloud.hpp"

namespace knap {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;
using Kind = TileAttribute::Kind;

constexpr std::array kCodings{TileCoding::kKdTree, TileCoding::kCurve, TileCoding::kSourceOrder};
constexpr std::array kTypes{ScalarType::kInt8,   ScalarType::kUint8,  ScalarType::kInt16,
                            ScalarType::kUint16, ScalarType::kInt32,  ScalarType::kUint32,
                            ScalarType::kInt64,  ScalarType::kUint64, ScalarType::kFloat32,
                            ScalarType::kFloat64};

Attribute plain(const std::string& name, ScalarType type) {
    return {name, type};
}

std::vector<Kind> kinds(const std::vector<Attribute>& attributes, TileCoding coding) {
    std::vector<Kind> result;
    for (const TileAttribute& attribute : tile_attributes(attributes, coding)) {
        result.push_back(attribute.kind);
    }
    return result;
}

TEST(TileLayout, RedGreenAndBlueOfOneSmallTypeAreAColour) {
    const auto colour = [](ScalarType red, ScalarType blue) {
        return std::vector<Attribute>{plain("blue", blue), plain("v", ScalarType::kInt8),
                                      plain("red", red), plain("green", red)};
    };
    for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16}) {
        const std::vector<TileAttribute> groups =
            tile_attributes(colour(type, type), TileCoding::kKdTree);
        ASSERT_EQ(groups.size(), 2U);
        EXPECT_EQ(groups[0].kind, Kind::kColor);
        EXPECT_THAT(groups[0].members, ElementsAre(2U, 3U, 0U));
        EXPECT_THAT(groups[1].members, ElementsAre(1U));
    }
    EXPECT_EQ(kinds(colour(ScalarType::kUint8, ScalarType::kUint16), TileCoding::kCurve),
              std::vector(4, Kind::kGeneric));
    EXPECT_EQ(kinds(colour(ScalarType::kFloat32, ScalarType::kFloat32), TileCoding::kCurve),
              std::vector(4, Kind::kGeneric));
    std::vector<Attribute> scaled = colour(ScalarType::kUint8, ScalarType::kUint8);
    scaled[3].scale = 2;
    EXPECT_EQ(kinds(scaled, TileCoding::kCurve), std::vector(4, Kind::kGeneric));
    scaled.pop_back();
    EXPECT_EQ(kinds(scaled, TileCoding::kCurve), std::vector(3, Kind::kGeneric));
}

TEST(TileLayout, FloatNormalsAreNormalsWhereDracoKeepsFloats) {
    for (const ScalarType type : {ScalarType::kFloat32, ScalarType::kFloat64}) {
        const std::vector<Attribute> normal{plain("nx", type), plain("ny", type),
                                            plain("nz", type)};
        const bool floats = type == ScalarType::kFloat32;
        EXPECT_EQ(kinds(normal, TileCoding::kCurve),
                  floats ? std::vector{Kind::kNormal} : std::vector(3, Kind::kGeneric));
        EXPECT_EQ(kinds(normal, TileCoding::kKdTree), std::vector(3, Kind::kGeneric));
    }
}

TEST(TileLayout, MoreComponentsThanDracoHoldsAreAnErrorNamingTheAttribute) {
    const auto check = [](ScalarType type, int components) {
        check_tile_attributes(std::vector<Attribute>{{"extra", type, components}});
    };
    EXPECT_NO_THROW(check(ScalarType::kUint8, 127));
    EXPECT_NO_THROW(check(ScalarType::kFloat64, 31));
    const auto check_bytes = [&] { check(ScalarType::kUint8, 128); };
    const auto check_doubles = [&] { check(ScalarType::kFloat64, 32); };
    EXPECT_THAT(check_bytes, ThrowsMessage<ConfigError>(HasSubstr("\"extra\"")));
    EXPECT_THAT(check_doubles, ThrowsMessage<ConfigError>(HasSubstr("\"extra\"")));
}

TEST(TileLayout, ACurveHasNearPointsNearAndSourceOrderIsAsGiven) {
    std::mt19937_64 random(1);
    const LatticeIndex origin{-5, 1000, 0};
    std::vector<LatticeIndex> points(4000);
    for (LatticeIndex& point : points) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            point[axis] = origin[axis] +
                          static_cast<std::int64_t>(random() % (std::uint64_t{1} << kTileBits));
        }
    }
    const auto length = [&](TileCoding coding) {
        const std::vector<std::size_t> order = coding_order(points, origin, coding);
        std::vector<std::size_t> sorted = order;
        std::sort(sorted.begin(), sorted.end());
        double sum = 0;
        for (std::size_t i = 0; i < order.size(); ++i) {
            EXPECT_EQ(sorted[i], i);
            for (std::size_t axis = 0; axis < 3 && i > 0; ++axis) {
                sum += std::abs(
                    static_cast<double>(points[order[i]][axis] - points[order[i - 1]][axis]));
            }
        }
        return sum;
    };
    EXPECT_LT(length(TileCoding::kCurve), length(TileCoding::kKdTree) / 4);
    const std::vector<std::size_t> given = coding_order(points, origin, TileCoding::kSourceOrder);
    EXPECT_TRUE(std::is_sorted(given.begin(), given.end()));
    std::vector<LatticeIndex> alike(10, origin);
    for (const TileCoding coding : kCodings) {
        const std::vector<std::size_t> order = coding_order(alike, origin, coding);
        EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
    }
}

/// A tile of random points with random attributes: one, several or all types, with one or more
/// components, any bits or small numbers.
TEST(TileLayout, WideNumbersAreStoredInPartsWhereDracoWouldCountThem) {
    const auto type_of = [](std::vector<std::int32_t> values, TileCoding coding) {
        return stored_type(ScalarType::kInt32, coding, std::as_bytes(std::span(values)));
    };
    constexpr std::int32_t kSpan = 1 << 20;
    constexpr std::int32_t kFar = 1 << 30;
    for (const TileCoding coding : {TileCoding::kCurve, TileCoding::kSourceOrder}) {
        EXPECT_EQ(type_of({-5, kSpan - 6}, coding), ScalarType::kInt32);
        EXPECT_EQ(type_of({-5, kSpan - 5}, coding), ScalarType::kUint16);
        EXPECT_EQ(type_of({kFar - 1, kFar - kSpan}, coding), ScalarType::kInt32);
        EXPECT_EQ(type_of({kFar}, coding), ScalarType::kUint16);
        EXPECT_EQ(type_of({}, coding), ScalarType::kInt32);
    }
    EXPECT_EQ(type_of({-kFar, kFar - 1}, TileCoding::kKdTree), ScalarType::kInt32);
    EXPECT_EQ(type_of({-kFar - 1}, TileCoding::kKdTree), ScalarType::kUint16);
}

TEST(TileLayout, EveryTypeComesBackToTheBitInEveryCoding) {
    std::mt19937_64 random(2);
    for (int round = 0; round < 60; ++round) {
        const std::size_t count = round == 0 ? 0 : 1 + random() % 400;
        const LatticeIndex origin{1 << 20, -77, 5};
        std::vector<LatticeIndex> points(count);
        for (LatticeIndex& point : points) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                point[axis] = origin[axis] + static_cast<std::int64_t>(random() % 50);
            }
        }
        TileFormat format{{{}, 0.25}, "EPSG:1", {}};
        std::vector<std::vector<std::byte>> columns;
        for (const ScalarType type : kTypes) {
            for (const bool small : {false, true}) {
                Attribute attribute{std::string(to_string(type)) + (small ? " small" : ""), type,
                                    1 + static_cast<int>(random() % 4)};
                attribute.scale = random() % 2 == 0 ? 1 : 0.01;
                attribute.offset = random() % 2 == 0 ? 0 : -1e-7;
                attribute.description = random() % 2 == 0 ? "" : "what it is";
                columns.push_back(test::random_column(random, attribute, count, small));
                format.attributes.push_back(std::move(attribute));
            }
        }
        for (const char* name : {"red", "green", "blue", "nx", "ny", "nz"}) {
            const bool colour = name[0] != 'n';
            format.attributes.push_back(
                plain(name, colour ? ScalarType::kUint16 : ScalarType::kFloat32));
            columns.push_back(test::random_column(random, format.attributes.back(), count, false));
        }
        std::vector<std::byte> rows;
        for (std::size_t i = 0; i < count; ++i) {
            for (std::size_t k = 0; k < columns.size(); ++k) {
                const std::size_t size = format.attributes[k].value_size();
                const auto value = std::span(columns[k]).subspan(i * size, size);
                rows.insert(rows.end(), value.begin(), value.end());
            }
        }
        for (const TileCoding coding : kCodings) {
            const DecodedTile tile =
                decode_tile(encode_tile({points, rows, origin}, format, coding), "tile");
            ASSERT_EQ(tile.columns.attributes.size(), format.attributes.size());
            // Each point with its row, told apart by both.
            std::vector<std::string> expected(count);
            std::vector<std::string> found(count);
            const auto add = [](std::string& text, const void* bytes, std::size_t size) {
                text.append(static_cast<const char*>(bytes), size);
            };
            for (std::size_t i = 0; i < count; ++i) {
                add(expected[i], points[i].data(), sizeof points[i]);
                add(found[i], tile.points[i].data(), sizeof points[i]);
            }
            for (std::size_t k = 0; k < columns.size(); ++k) {
                const auto place = std::find(tile.columns.attributes.begin(),
                                             tile.columns.attributes.end(), format.attributes[k]);
                ASSERT_NE(place, tile.columns.attributes.end()) << format.attributes[k].name;
                const auto& values =
                    tile.columns
                        .values[static_cast<std::size_t>(place - tile.columns.attributes.begin())];
                const std::size_t size = format.attributes[k].value_size();
                for (std::size_t i = 0; i < count; ++i) {
                    add(expected[i], columns[k].data() + i * size, size);
                    add(found[i], values.data() + i * size, size);
                }
            }
            if (coding != TileCoding::kSourceOrder) {
                std::sort(expected.begin(), expected.end());
                std::sort(found.begin(), found.end());
            }
            EXPECT_EQ(found, expected) << "round " << round;
        }
    }
}

TEST(TileLayout, TheSmallestOfAllWaysIsTaken) {
    std::mt19937_64 random(3);
    const TileFormat format{{{}, 1}, "", {plain("time", ScalarType::kFloat64)}};
    std::vector<LatticeIndex> points(3000);
    std::vector<std::byte> rows(points.size() * sizeof(double));
    for (std::size_t i = 0; i < points.size(); ++i) {
        points[i] = {static_cast<std::int64_t>(random() % 1000),
                     static_cast<std::int64_t>(random() % 1000), 0};
        // Seconds that rise from point to point.
        const double time = 3e5 + 1e-5 * static_cast<double>(i);
        std::memcpy(rows.data() + i * sizeof time, &time, sizeof time);
    }
    const TilePoints tile{points, rows, {}};
    const auto size = [&](TileCoding coding) { return encode_tile(tile, format, coding).size(); };
    const std::size_t smallest = encode_smallest(tile, format, TileEncoding::kAuto).size();
    EXPECT_EQ(smallest, size(TileCoding::kSourceOrder));
    EXPECT_LT(smallest, std::min(size(TileCoding::kCurve), size(TileCoding::kKdTree)));
    EXPECT_EQ(encode_smallest(tile, format, TileEncoding::kKdTree).size(),
              size(TileCoding::kKdTree));
}

}  // namespace
}  // namespace knap
