#include "merge/alpha_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "knap/simplify.hpp"
#include "merge/range_law.hpp"
#include "support/clouds.hpp"
#include "support/random_params.hpp"

namespace knap {
namespace {

TEST(SampleCells, AreAllOfASmallArchiveAndASmallShareOfALargeOne) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> unit(0, 1);
    const SampleCells small(100000, 0.001);
    const SampleCells large(100'000'000, 0.0001);
    int inside = 0;
    for (int i = 0; i < 200000; ++i) {
        const Vec3 p{unit(random), unit(random), 0.1 * unit(random)};
        ASSERT_TRUE(small.contains(p));
        inside += large.contains(p) ? 1 : 0;
    }
    EXPECT_NEAR(inside / 200000.0, 1048576 / 1e8, 0.003);
    // A cell as a whole, wherever it lies.
    const SampleCells far(10'000'000, 0.01);
    int changes = 0;
    for (int i = 0; i < 100000; ++i) {
        const double x = -3e6 + 0.001 * i;
        changes += far.contains({x, 5, 7}) != far.contains({x + 0.001, 5, 7}) ? 1 : 0;
    }
    EXPECT_LE(changes, 200);
}

TEST(AlphaSearch, FindsTheCountThatIsWantedWithinOnePerCent) {
    std::mt19937_64 random(2);
    const std::vector<Vec3> cloud = test::sphere_cloud(40000, 3);
    for (int round = 0; round < 12; ++round) {
        SimplifyParams params = test::random_params(random, cloud);
        params.range.alpha = params.range.tolerance = params.range.repair = 0;
        const std::uint64_t wanted = 500 + random() % 30000;
        if (round % 2 == 0) {
            params.range.count = wanted;
        } else {
            params.range.ratio = static_cast<double>(wanted) / 40000;
        }
        const SimplifyResult found = simplify(cloud, params);
        ASSERT_NEAR(static_cast<double>(found.counts.kept), static_cast<double>(wanted),
                    0.01 * static_cast<double>(wanted))
            << "round " << round;
        // The alpha that it says it found is the one.
        params.range.count = 0;
        params.range.ratio = 0;
        params.range.alpha = found.alpha;
        EXPECT_EQ(simplify(cloud, params).kept, found.kept);
    }
}

TEST(AlphaSearch, ByASampleOfALargeCloudComesAsNear) {
    const std::vector<Vec3> cloud = test::sphere_cloud(400000, 4);
    for (const std::uint64_t wanted : {3000U, 40000U, 200000U}) {
        SimplifyParams params;
        params.range.count = wanted;
        const SimplifyResult found = simplify(cloud, params);
        EXPECT_NEAR(static_cast<double>(found.counts.kept), static_cast<double>(wanted),
                    0.01 * static_cast<double>(wanted));
    }
}

TEST(AlphaSearch, WhereCellsForetellNothingComesAsNear) {
    std::mt19937_64 random(8);
    std::uniform_real_distribution<double> unit(0, 1);
    // A body, not a surface: a handful of cells, wherever it lies. And a sheet with one outlier,
    // beside whose spacing a cell is as large as the sheet.
    for (const double offset : {0.0, 6.6, 31.4}) {
        std::vector<Vec3> body(250000);
        for (Vec3& p : body) {
            p = {offset + unit(random), unit(random) - offset / 2, unit(random)};
        }
        std::vector<Vec3> sheet(250000);
        for (Vec3& p : sheet) {
            p = {offset + 6 * unit(random), 6 * unit(random), 0};
            p.z = 0.3 * std::sin(3 * p.x) * std::cos(2 * p.y);
        }
        sheet[77] = {3e5, 3e5, offset};
        for (const std::vector<Vec3>& cloud : {body, sheet}) {
            SimplifyParams params;
            params.range.count = 20000;
            const SimplifyResult found = simplify(cloud, params);
            EXPECT_NEAR(static_cast<double>(found.counts.kept), 20000, 200) << offset;
        }
    }
}

TEST(AlphaSearch, EndsWithTheBestWhereNoneIsNearEnough) {
    // A count that jumps from 100 to 20: the best of ten walks is made once more.
    AlphaSearch search(
        {.range = {}, .mean_curvature = 1, .spacing = 0.1, .points = 1000000, .wanted = 70}, {});
    int walks = 0;
    double last = 0;
    while (!search.done() && walks < 100) {
        last = search.next();
        search.told(last, last < 3 ? 100 : 20);
        ++walks;
    }
    EXPECT_LE(walks, 12);
    EXPECT_LT(last, 3) << "100 is nearer to 70 than 20 is";
}

TEST(AlphaSearch, OfAllPointsOrMoreKeepsAllAndOfOneKeepsOne) {
    std::mt19937_64 random(5);
    for (int round = 0; round < 100; ++round) {
        const std::vector<Vec3> cloud = test::random_cloud(random);
        SimplifyParams params;
        params.range.count = cloud.size() + random() % 3;
        const SimplifyResult all = simplify(cloud, params);
        ASSERT_EQ(all.counts.represented, 0U);
        params.range.count = 1;
        params.range.max_factor = HUGE_VAL;
        const SimplifyResult one = simplify(cloud, params);
        ASSERT_GE(one.counts.kept, std::min<std::uint64_t>(1, all.counts.kept));
    }
}

TEST(WithAlpha, OfAToleranceIsTheChordWithThatHeight) {
    const RangeParams range = with_alpha({.law = RangeLawKind::kChord, .tolerance = 0.02}, 4);
    // A chord of half length r over curvature H is r^2 H / 2 high.
    EXPECT_NEAR(range.alpha * range.alpha * 4 / 2, 0.02, 1e-15);
    EXPECT_NEAR(RangeLaw(range, 4).of(9), std::sqrt(2 * 0.02 / 9), 1e-15);
    EXPECT_EQ(with_alpha({.alpha = 3}, 4).alpha, 3);
}

}  // namespace
}  // namespace knap
