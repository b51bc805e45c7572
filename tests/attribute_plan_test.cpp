#include "emit/attribute_plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "base/bytes.hpp"
#include "base/scalar.hpp"
#include "knap/error.hpp"

namespace knap {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

constexpr std::array kTypes{ScalarType::kInt8,   ScalarType::kUint8,  ScalarType::kInt16,
                            ScalarType::kUint16, ScalarType::kInt32,  ScalarType::kUint32,
                            ScalarType::kInt64,  ScalarType::kUint64, ScalarType::kFloat32,
                            ScalarType::kFloat64};

SourceInfo source(const std::string& path, std::vector<Attribute> attributes) {
    SourceInfo info;
    info.path = path;
    info.schema = {{"x"}, {"y"}, {"z"}};
    info.schema.insert(info.schema.end(), attributes.begin(), attributes.end());
    return info;
}

Attribute attribute(const std::string& name, ScalarType type, int components = 1) {
    return {name, type, components};
}

const std::vector<std::string> kAll{"all"};

std::vector<std::string> names(const AttributePlan& plan) {
    std::vector<std::string> result;
    for (const Attribute& attribute : plan.attributes) {
        result.push_back(attribute.name);
    }
    return result;
}

TEST(AttributePlan, TakesAllNoneOrThoseNamed) {
    const std::vector<SourceInfo> sources{
        source("a.las", {attribute("intensity", ScalarType::kUint16),
                         attribute("offsets", ScalarType::kFloat64, 3)}),
        source("b.ply", {attribute("red", ScalarType::kUint8)})};
    const AttributePlan all = plan_attributes(sources, kAll);
    EXPECT_THAT(names(all), ElementsAre("intensity", "offsets", "red"));
    EXPECT_THAT(all.offsets, ElementsAre(0U, 2U, 26U));
    EXPECT_EQ(all.row_size, 27U);
    EXPECT_THAT(all.selected(), ElementsAre(ElementsAre(3U, 4U), ElementsAre(3U)));
    const AttributePlan some =
        plan_attributes(sources, std::vector<std::string>{"red", "intensity"});
    EXPECT_THAT(names(some), ElementsAre("intensity", "red"));
    EXPECT_THAT(some.selected(), ElementsAre(ElementsAre(3U), ElementsAre(3U)));
    const AttributePlan none = plan_attributes(sources, std::vector<std::string>{"none"});
    EXPECT_TRUE(none.empty());
    EXPECT_EQ(none.row_size, 0U);
    EXPECT_THAT(none.selected(), ElementsAre(IsEmpty(), IsEmpty()));
}

TEST(AttributePlan, ANameThatNoSourceHasIsAnErrorThatListsThoseThereAre) {
    const std::vector<SourceInfo> sources{
        source("a.las", {attribute("intensity", ScalarType::kUint16)}),
        source("b.las", {attribute("red", ScalarType::kUint8)})};
    EXPECT_THAT(
        [&] {
            plan_attributes(sources, std::vector<std::string>{"red", "rde"});
        },
        ThrowsMessage<ConfigError>(AllOf(HasSubstr("output.attributes (--attributes)"),
                                         HasSubstr("(intensity, red)"),
                                         HasSubstr("found \"rde\""))));
}

/// Whether a type gives a value back as it was.
bool keeps(ScalarType type, ScalarType from, const std::byte* bytes) {
    return visit_scalar(from, [&](auto from_tag) {
        typename decltype(from_tag)::Type value{};
        std::memcpy(&value, bytes, sizeof value);
        return visit_scalar(type, [&](auto tag) {
            // Long doubles hold every value of every type.
            using To = typename decltype(tag)::Type;
            const auto wide = static_cast<long double>(value);
            const bool inside =
                wide >= static_cast<long double>(std::numeric_limits<To>::lowest()) &&
                wide <= static_cast<long double>(std::numeric_limits<To>::max());
            return inside && static_cast<long double>(static_cast<To>(value)) == wide;
        });
    });
}

/// Values of a type that are hard to hold.
std::vector<std::array<std::byte, 8>> extremes(ScalarType type) {
    return visit_scalar(type, [](auto tag) {
        using T = typename decltype(tag)::Type;
        using Limits = std::numeric_limits<T>;
        std::vector<std::array<std::byte, 8>> result;
        for (const T value : {Limits::lowest(), Limits::max(), T(Limits::max() - T(1)),
                              Limits::is_integer ? T(1) : T(0.1)}) {
            std::memcpy(result.emplace_back().data(), &value, sizeof value);
        }
        return result;
    });
}

TEST(AttributePlan, TwoTypesBecomeTheSmallestThatHoldsBothOrAnError) {
    for (const ScalarType a : kTypes) {
        for (const ScalarType b : kTypes) {
            const std::vector<SourceInfo> sources{source("a.las", {attribute("v", a)}),
                                                  source("b.las", {attribute("v", b)})};
            const auto holds_both = [&](ScalarType type) {
                for (const ScalarType from : {a, b}) {
                    for (const std::array<std::byte, 8>& value : extremes(from)) {
                        if (!keeps(type, from, value.data())) {
                            return false;
                        }
                    }
                }
                return true;
            };
            std::size_t smallest = 9;
            for (const ScalarType type : kTypes) {
                smallest = holds_both(type) ? std::min(smallest, size_of(type)) : smallest;
            }
            const std::string pair = std::string(to_string(a)) + ", " + to_string(b);
            if (smallest == 9) {
                EXPECT_THAT([&] { plan_attributes(sources, kAll); },
                            ThrowsMessage<ConfigError>(AllOf(HasSubstr("a.las"), HasSubstr("b.las"),
                                                             HasSubstr("\"v\""),
                                                             HasSubstr("--attributes"))))
                    << pair;
                continue;
            }
            const ScalarType type = plan_attributes(sources, kAll).attributes.front().type;
            EXPECT_TRUE(holds_both(type)) << pair;
            EXPECT_EQ(size_of(type), smallest) << pair;
            EXPECT_TRUE(a != b || type == a) << pair;
        }
    }
}

TEST(AttributePlan, OtherComponentsScalesOrOffsetsAreAnErrorNamingBothFiles) {
    Attribute plain = attribute("height", ScalarType::kInt16);
    Attribute scaled = plain;
    scaled.scale = 0.01;
    Attribute moved = plain;
    moved.offset = 5;
    for (const Attribute& other : {attribute("height", ScalarType::kInt16, 2), scaled, moved}) {
        const std::vector<SourceInfo> sources{source("a.las", {plain}), source("b.las", {other})};
        EXPECT_THAT([&] { plan_attributes(sources, kAll); },
                    ThrowsMessage<ConfigError>(
                        AllOf(HasSubstr("a.las"), HasSubstr("b.las"), HasSubstr("height"))));
    }
    Attribute described = plain;
    described.description = "above ground";
    const std::vector<SourceInfo> sources{source("a.las", {plain}), source("b.las", {described})};
    EXPECT_EQ(plan_attributes(sources, kAll).attributes.front().description, "above ground");
}

TEST(AttributePlan, RowsHoldTheValuesOfThePointsAskedFor) {
    const std::vector<SourceInfo> sources{
        source("a.las",
               {attribute("v", ScalarType::kInt8), attribute("w", ScalarType::kFloat32, 2)}),
        source("b.las", {attribute("u", ScalarType::kUint8), attribute("v", ScalarType::kUint8)})};
    const AttributePlan plan = plan_attributes(sources, kAll);
    ASSERT_THAT(names(plan), ElementsAre("v", "w", "u"));
    Chunk first;
    first.columns.resize(2);
    Chunk second;
    second.columns.resize(2);
    for (int i = 0; i < 3; ++i) {
        put(first.columns[0], static_cast<std::int8_t>(i - 2));
        put(first.columns[1], 0.5F + static_cast<float>(i));
        put(first.columns[1], 0.25F + static_cast<float>(i));
        put(second.columns[0], static_cast<std::uint8_t>(i + 7));
        put(second.columns[1], static_cast<std::uint8_t>(i + 200));
    }
    std::vector<std::byte> rows;
    plan.append_rows(0, first, std::vector<std::uint32_t>{0, 2}, rows);
    plan.append_rows(1, second, std::vector<std::uint32_t>{1}, rows);
    ASSERT_EQ(rows.size(), 3 * plan.row_size);
    ByteReader fields(rows);
    std::vector<double> found;
    for (int i = 0; i < 3; ++i) {
        found.push_back(fields.get<std::int16_t>());
        found.push_back(fields.get<float>());
        found.push_back(fields.get<float>());
        found.push_back(fields.get<std::uint8_t>());
    }
    EXPECT_THAT(found, ElementsAre(-2, 0.5, 0.25, 0, 0, 2.5, 2.25, 0, 201, 0, 0, 8));
}

TEST(AttributePlan, LimitsAreThoseThatHoldInAllSources) {
    const auto bits = [](auto value) { return std::bit_cast<std::uint64_t>(value); };
    Attribute byte = attribute("v", ScalarType::kUint8);
    byte.limits = {{7}, {3}, {200}};
    Attribute word = attribute("v", ScalarType::kInt16);
    word.limits = {{7}, {bits(std::int64_t{-4})}, {100}};
    Attribute real = attribute("v", ScalarType::kFloat32);
    real.limits = {{bits(7.0)}, {bits(2.5)}, {bits(1e9)}};
    const auto planned = [](const std::vector<Attribute>& given) {
        std::vector<SourceInfo> sources;
        for (const Attribute& one : given) {
            sources.push_back(source("a.las", {one}));
        }
        return plan_attributes(sources, kAll).attributes.at(0).limits;
    };
    EXPECT_EQ(planned({byte}), byte.limits);
    EXPECT_EQ(planned({byte, word}), (ValueLimits{{7}, word.limits.least, {200}}));
    EXPECT_EQ(planned({word, byte}), (ValueLimits{{7}, word.limits.least, {200}}));
    EXPECT_EQ(planned({byte, real}), (ValueLimits{{bits(7.0)}, {bits(2.5)}, {bits(1e9)}}));
    word.limits.missing = {8};
    word.limits.greatest = {};
    EXPECT_EQ(planned({byte, word}), (ValueLimits{{}, word.limits.least, {}}));
    // A point of a source without the attribute has 0.
    EXPECT_EQ(plan_attributes(std::vector{source("a.las", {byte}), source("b.las", {})}, kAll)
                  .attributes.at(0)
                  .limits,
              (ValueLimits{{7}, {}, {}}));
}

TEST(AttributePlan, TheNotesTellWhatIsMissingLeftOutAndNotSupported) {
    SourceEntry first;
    first.info = source("a.las", {attribute("v", ScalarType::kInt8)});
    first.info.unsupported = {"waveform packets"};
    first.points = 10;
    SourceEntry second = first;
    second.info = source("b.las", {attribute("w", ScalarType::kInt8)});
    second.points = 7;
    const SourceTable table({first, second, first}, Box{});
    EXPECT_THAT(attribute_notes(table, plan_attributes(table.infos(), kAll)),
                ElementsAre(AllOf(HasSubstr("\"v\""), HasSubstr("in 7 input points")),
                            AllOf(HasSubstr("\"w\""), HasSubstr("in 20 input points")),
                            HasSubstr("waveform packets")));
    const std::vector<std::string> only_v{"v"};
    EXPECT_THAT(attribute_notes(table, plan_attributes(table.infos(), only_v)),
                testing::Contains(HasSubstr("1 attributes stay behind")));
}

}  // namespace
}  // namespace knap
