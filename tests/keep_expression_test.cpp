#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "keep/expression.hpp"
#include "knap/error.hpp"

namespace knap {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

bool holds(const std::string& text, const std::vector<double>& values) {
    return KeepExpression(text).holds(values);
}

TEST(KeepExpression, EveryComparisonIsThatOfNumbers) {
    for (const double a : {-1.5, 0.0, 2.0, 1e300}) {
        for (const double b : {-1.5, 0.0, 2.0}) {
            const std::string number = std::to_string(b);
            EXPECT_EQ(holds("a == " + number, {a}), a == b);
            EXPECT_EQ(holds("a != " + number, {a}), a != b);
            EXPECT_EQ(holds("a < " + number, {a}), a < b);
            EXPECT_EQ(holds("a <= " + number, {a}), a <= b);
            EXPECT_EQ(holds("a > " + number, {a}), a > b);
            EXPECT_EQ(holds("a >= " + number, {a}), a >= b);
        }
    }
}

TEST(KeepExpression, AndBindsTighterThanOrAndParenthesesWin) {
    for (int bits = 0; bits < 8; ++bits) {
        const bool a = (bits & 1) != 0;
        const bool b = (bits & 2) != 0;
        const bool c = (bits & 4) != 0;
        const std::vector<double> values{double(a), double(b), double(c)};
        EXPECT_EQ(holds("a==1||b==1&&c==1", values), a || (b && c));
        EXPECT_EQ(holds("(a==1 || b==1) && c==1", values), (a || b) && c);
        EXPECT_EQ(holds("!(a==1 && b==1) || !c==1", values), !(a && b) || !c);
        EXPECT_EQ(holds("a==1 && b==1 && c==1", values), a && b && c);
    }
}

TEST(KeepExpression, NamesAreAskedForOnceAndMayBeQuoted) {
    const KeepExpression expression(
        "classification==2 || \"my name\"[2]>=-1e-3 && classification != +7 || a.b_1 < .5");
    const std::vector<KeepExpression::Variable> expected{
        {"classification", 0}, {"my name", 2}, {"a.b_1", 0}};
    EXPECT_EQ(expression.variables(), expected);
    EXPECT_TRUE(expression.holds(std::vector<double>{2, -1, 1}));
    EXPECT_TRUE(expression.holds(std::vector<double>{3, -1e-3, 1}));
    EXPECT_FALSE(expression.holds(std::vector<double>{7, 0, 1}));
}

TEST(KeepExpression, WhatIsWrongIsToldWithItsColumn) {
    const std::vector<std::pair<std::string, std::string>> cases{
        {"", "column 1: expected the name of an attribute, ! or (, found the end"},
        {"a", "column 2: expected ==, !=, <, <=, > or >=, found the end"},
        {"a = 2", "column 3: expected ==, !=, <, <=, > or >=, found \"= 2\""},
        {"a == b", "column 6: expected a number, found \"b\""},
        {"a == 2x", "column 6: expected a number, found \"2x\""},
        {"a == 2 b", "column 8: expected &&, || or the end, found \"b\""},
        {"(a == 2", "column 8: expected ), found the end"},
        {"a[x] == 2", "column 3: expected a component: 0, 1, .., found \"x] == 2\""},
        {"a[1 == 2", "column 5: expected ], found \"== 2\""},
        {"\"a == 2", "column 1: expected a name between quotes"},
        {"a == 2 &&", "column 10: expected the name"},
        {"2 == a", "column 1: expected the name"},
        {std::string(101, '('), "expected at most 100 parentheses"},
    };
    for (const auto& [text, message] : cases) {
        EXPECT_THAT([&] { KeepExpression{text}; },
                    ThrowsMessage<ConfigError>(HasSubstr("range.keep (--keep): ")))
            << text;
        EXPECT_THAT([&] { KeepExpression{text}; }, ThrowsMessage<ConfigError>(HasSubstr(message)))
            << text;
    }
}

}  // namespace
}  // namespace knap
