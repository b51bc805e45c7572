#include "base/exact_sum.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include "support/reference.hpp"

namespace knap {
namespace {

constexpr double kMax = std::numeric_limits<double>::max();
constexpr double kTiny = std::numeric_limits<double>::denorm_min();

double sum_of(std::span<const double> values) {
    ExactSum sum;
    for (const double value : values) {
        sum.add(value);
    }
    return sum.value();
}

// Any sign, mantissa and exponent from 2^low, subnormal below 2^-1022; many cancel each other.
std::vector<double> random_values(std::mt19937_64& random, int low, int high) {
    std::vector<double> values(1 + random() % 60);
    for (double& value : values) {
        const int exponent = std::uniform_int_distribution<int>(low, high)(random);
        const auto mantissa = static_cast<double>(random() >> (11 + random() % 53));
        value = std::ldexp(random() % 2 == 0 ? mantissa : -mantissa, exponent - 52);
    }
    for (std::size_t i = 1; i < values.size(); ++i) {
        if (random() % 3 == 0) {
            values[i] = -values[random() % i];
        }
    }
    return values;
}

TEST(ExactSum, IsTheCorrectlyRoundedSumForAnyMagnitudes) {
    std::mt19937_64 random(1);
    constexpr std::pair<int, int> kExponents[] = {
        {-1074, 1000}, {-1074, -1015}, {-60, 60}, {-3, 3}, {900, 1000}};
    for (int round = 0; round < 20000; ++round) {
        const auto [low, high] = kExponents[round % std::ssize(kExponents)];
        const std::vector<double> values = random_values(random, low, high);
        ASSERT_EQ(sum_of(values), reference::exact_sum(values)) << "round " << round;
    }
}

TEST(ExactSum, DoesNotDependOnTheOrderNorOnHowItIsSplitIntoParts) {
    std::mt19937_64 random(2);
    for (int round = 0; round < 2000; ++round) {
        std::vector<double> values = random_values(random, -1074, 960);
        const double expected = sum_of(values);
        std::shuffle(values.begin(), values.end(), random);
        std::vector<ExactSum> parts(1 + random() % 5);
        for (const double value : values) {
            parts[random() % parts.size()].add(value);
        }
        ExactSum whole;
        for (const ExactSum& part : parts) {
            whole.add(part);
        }
        ASSERT_EQ(std::bit_cast<std::uint64_t>(whole.value()),
                  std::bit_cast<std::uint64_t>(expected));
    }
}

TEST(ExactSum, RoundsHalfToEvenAndSeesWhatIsFarBelow) {
    const double half = std::ldexp(1.0, -53);
    EXPECT_EQ(sum_of(std::vector{1.0, half}), 1.0);
    EXPECT_EQ(sum_of(std::vector{1.0, half, kTiny}), std::nextafter(1.0, 2.0));
    EXPECT_EQ(sum_of(std::vector{1.0, half, -kTiny}), 1.0);
    EXPECT_EQ(sum_of(std::vector{std::nextafter(1.0, 2.0), half}), 1 + std::ldexp(1.0, -51));
    EXPECT_EQ(sum_of(std::vector{-1.0, -half, -kTiny}), std::nextafter(-1.0, -2.0));
}

TEST(ExactSum, SurvivesPartialSumsThatOverflowADouble) {
    EXPECT_EQ(sum_of(std::vector{kMax, kMax, kMax, -kMax, -kMax, 1.0, -kMax}), 1.0);
    EXPECT_EQ(sum_of(std::vector{kMax, kMax}), std::numeric_limits<double>::infinity());
    EXPECT_EQ(sum_of(std::vector{-kMax, -kMax, kMax}), -kMax);
}

TEST(ExactSum, OfNothingIsZero) {
    EXPECT_EQ(ExactSum().value(), 0.0);
    EXPECT_EQ(sum_of(std::vector{kTiny, -kTiny}), 0.0);
    EXPECT_EQ(sum_of(std::vector{kTiny}), kTiny);
}

TEST(ExactSum, GoesOnFromItsLimbs) {
    std::mt19937_64 random(9);
    for (int round = 0; round < 200; ++round) {
        ExactSum whole;
        ExactSum part;
        for (int i = 0; i < 50; ++i) {
            const double value = std::ldexp(static_cast<double>(random()) - 0x1p63,
                                            static_cast<int>(random() % 600) - 300);
            whole.add(value);
            part.add(value);
            if (i % 7 == 0) {
                part = ExactSum::from_limbs(part.limbs());
            }
        }
        ASSERT_EQ(part.value(), whole.value());
    }
}

}  // namespace
}  // namespace knap
