#include "evaluate/deviation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace knap {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(DeviationSum, IsThatOfAllDistancesInAnyParts) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 20; ++round) {
        std::vector<double> distances(1 + random() % 5000);
        std::vector<DeviationSum> parts(3);
        double squares = 0;
        double sum = 0;
        for (double& d : distances) {
            d = random() % 50 == 0 ? 0 : std::pow(10, std::normal_distribution<double>(-3)(random));
            parts[random() % 3].add({.distance = d, .to_plane = d / 2});
            sum += d;
            squares += d * d;
        }
        parts[0].add(parts[1]);
        parts[0].add(parts[2]);
        const Deviation found = parts[0].result(4);
        std::sort(distances.begin(), distances.end());
        const auto n = static_cast<double>(distances.size());
        EXPECT_EQ(found.points, distances.size());
        EXPECT_NEAR(found.mean, sum / n, 1e-12 * sum);
        EXPECT_NEAR(found.rms, std::sqrt(squares / n), 1e-12 * found.rms);
        EXPECT_EQ(found.max, distances.back());
        EXPECT_NEAR(found.facet_d, squares / 16, 1e-12 * squares);
        const double exact = distances[distances.size() - distances.size() / 100 - 1];
        EXPECT_GE(found.p99, exact);
        EXPECT_LE(found.p99, exact * 1.001);
    }
}

TEST(DeviationSum, OfNothingIsNothingAndWithoutFacetsHasNoD) {
    EXPECT_EQ(DeviationSum().result(1).points, 0U);
    EXPECT_EQ(DeviationSum().result(1).p99, 0);
    DeviationSum sum;
    sum.add({.distance = 1});
    EXPECT_TRUE(std::isnan(sum.result(kNan).facet_d));
}

}  // namespace
}  // namespace knap
