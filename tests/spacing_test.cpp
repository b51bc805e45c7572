#include "rank/spacing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/threads.hpp"
#include "rank/brick_blocks.hpp"
#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"
#include "support/reference.hpp"

namespace knap {
namespace {

constexpr test::Halo kHalos[] = {test::Halo::kPlanned, test::Halo::kNone, test::Halo::kAll};

struct Spacing {
    double sum = 0;
    std::uint64_t count = 0;
};

enum class Way { kWhole, kSparse };

BrickSpacing spacing_of(const test::CutBrick& brick, const SpacingSample& sample, const Box& box,
                        Way way) {
    if (way == Way::kWhole) {
        return brick_spacing(block_brick(brick.points), sample, brick.brick.halo, box);
    }
    std::vector<TaggedPoint> points;
    for (std::size_t i = 0; i < brick.points.ids.size(); ++i) {
        points.emplace_back(brick.points.positions[i], brick.points.ids[i],
                            i < brick.points.core_count);
    }
    return sparse_spacing(points, sample, brick.brick.halo, box);
}

// The spacing of a cut: what each brick knows, and the rest gathered.
Spacing spacing_of(const test::CutCloud& cut, const SpacingSample& sample, Way way = Way::kWhole) {
    BrickSpacing total;
    CoreAccess cores;
    for (const test::CutBrick& brick : cut.bricks) {
        const BrickSpacing part = spacing_of(brick, sample, cut.box, way);
        total.sum.add(part.sum);
        total.count += part.count;
        total.stragglers.insert(total.stragglers.end(), part.stragglers.begin(),
                                part.stragglers.end());
        cores.boxes.push_back(brick.core_box);
    }
    cores.load = [&](std::size_t brick) {
        BrickPoints core = cut.bricks[brick].points;
        core.positions.resize(core.core_count);
        core.ids.resize(core.core_count);
        return distinct_points(std::move(core));
    };
    for (const auto& nearest : gather(total.stragglers, 1, cores)) {
        if (!nearest.empty()) {
            total.sum.add(std::sqrt(nearest.front().squared_distance));
            ++total.count;
        }
    }
    return {total.sum.value(), total.count};
}

TEST(Spacing, IsThatOfBruteForceForAnyCutIntoBricks) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 200; ++round) {
        const std::vector<Vec3> cloud = test::random_cloud(random);
        const test::Points distinct = test::distinct_points(cloud);
        std::vector<double> distances;
        for (std::size_t i = 0; i < distinct.ids.size(); ++i) {
            const auto nearest =
                test::nearest_by_force(distinct, distinct.positions[i], distinct.ids[i], 1);
            if (!nearest.empty()) {
                distances.push_back(std::sqrt(nearest.front().squared_distance));
            }
        }
        const test::Points points = test::finite_points(cloud);
        const ThreadLimit limit(1 + round % 3);
        const test::CutCloud cut =
            test::cut_cloud(random, points, 1 + random() % 300, kHalos[round % 3]);
        const Spacing found = spacing_of(cut, SpacingSample(points.ids.size()));
        ASSERT_EQ(found.count, distances.size()) << "round " << round;
        ASSERT_EQ(found.sum, reference::exact_sum(distances)) << "round " << round;
        const Spacing sparse = spacing_of(cut, SpacingSample(points.ids.size()), Way::kSparse);
        ASSERT_EQ(sparse.count, distances.size()) << "round " << round;
        ASSERT_EQ(sparse.sum, found.sum) << "round " << round;
    }
}

TEST(Spacing, OfASampleIsTheSameForAnyCut) {
    std::mt19937_64 random(2);
    const test::Points points = test::finite_points(test::sphere_cloud(20000, 6));
    // As of an archive of which these are the first points.
    const SpacingSample sample(5'000'000);
    const Spacing whole =
        spacing_of(test::cut_cloud(random, points, 100000, test::Halo::kAll), sample);
    EXPECT_GT(whole.count, 1000U);
    EXPECT_LT(whole.count, 19000U);
    for (const test::Halo halo : kHalos) {
        const Spacing cut = spacing_of(test::cut_cloud(random, points, 2000, halo), sample);
        EXPECT_EQ(cut.sum, whole.sum);
        EXPECT_EQ(cut.count, whole.count);
        const test::CutCloud bricks = test::cut_cloud(random, points, 2000, halo);
        const Spacing sparse = spacing_of(bricks, sample, Way::kSparse);
        EXPECT_EQ(sparse.sum, whole.sum);
        EXPECT_EQ(sparse.count, whole.count);
    }
}

TEST(Spacing, LeavesToTheExtraPassOnlyWhatItsHaloCannotSettle) {
    std::mt19937_64 random(3);
    for (int round = 0; round < 100; ++round) {
        const test::Points points = test::finite_points(test::random_cloud(random));
        const test::CutCloud cut =
            test::cut_cloud(random, points, 1 + random() % 300, test::Halo::kPlanned);
        for (const test::CutBrick& brick : cut.bricks) {
            const BrickSpacing part =
                brick_spacing(block_brick(brick.points), SpacingSample(points.ids.size()),
                              brick.brick.halo, cut.box);
            for (const Straggler& straggler : part.stragglers) {
                const double certain =
                    certain_squared_distance(straggler.position, brick.brick.halo, cut.box);
                ASSERT_GE(straggler.bound_squared, certain);
            }
            ASSERT_LE(part.count + part.stragglers.size(), brick.points.core_count);
        }
    }
}

TEST(SpacingSample, HoldsEveryPointOfUpToAMillion) {
    for (const std::uint64_t points :
         {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1'000'000}}) {
        const SpacingSample sample(points);
        for (PointId id = 0; id < 100000; ++id) {
            ASSERT_TRUE(sample.contains(id));
        }
    }
}

TEST(SpacingSample, HoldsAMillionAndAQuarterOfMore) {
    for (const double points : {2e6, 1e8}) {
        const SpacingSample sample(static_cast<std::uint64_t>(points));
        constexpr double kTried = 1'000'000;
        double held = 0;
        for (PointId id = 0; id < static_cast<PointId>(kTried); ++id) {
            held += sample.contains(id) ? 1 : 0;
        }
        // Six standard deviations of a fair choice.
        const double share = 1.25e6 / points;
        EXPECT_NEAR(held, kTried * share, 6 * std::sqrt(kTried * share * (1 - share)));
    }
    // Just above a million, where a million and a quarter are more than there are.
    const SpacingSample all(1'000'001);
    EXPECT_TRUE(all.contains(1'000'000));
}

}  // namespace
}  // namespace knap
