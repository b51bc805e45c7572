#include "merge/merge.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <random>
#include <utility>

#include "base/threads.hpp"
#include "knap/error.hpp"
#include "merge/range_law.hpp"
#include "merge/region.hpp"
#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"

namespace knap {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

// A run in memory, given out in blocks of any size.
class Blocks final : public RankedStream {
  public:
    Blocks(std::vector<RankedPoint> points, std::uint64_t seed)
        : points_(std::move(points)), random_(seed) {}
    bool next(std::vector<RankedPoint>& points) override {
        const std::size_t count = std::min<std::size_t>(1 + random_() % 50, points_.size() - at_);
        const auto begin = points_.begin() + static_cast<std::ptrdiff_t>(at_);
        points.assign(begin, begin + static_cast<std::ptrdiff_t>(count));
        at_ += count;
        return count > 0;
    }

  private:
    std::vector<RankedPoint> points_;
    std::mt19937_64 random_;
    std::size_t at_ = 0;
};

// Parts that lie anywhere, each in a few runs. Uneven: most points go to few of them.
std::vector<RankedPart> split_at_random(std::mt19937_64& random,
                                        const std::vector<RankedPoint>& ordered) {
    std::vector<std::vector<std::vector<RankedPoint>>> split(1 + random() % 12);
    for (auto& runs : split) {
        runs.resize(1 + random() % 3);
    }
    for (const RankedPoint& point : ordered) {
        auto& runs = split[random() % (1 + random() % split.size())];
        runs[random() % runs.size()].push_back(point);
    }
    std::vector<RankedPart> parts;
    for (auto& runs : split) {
        parts.emplace_back();
        for (auto& run : runs) {
            for (const RankedPoint& point : run) {
                parts.back().box.extend(point.position);
            }
            parts.back().points += run.size();
            parts.back().runs.push_back(std::make_unique<Blocks>(std::move(run), random()));
        }
    }
    return parts;
}

// Slabs across x, as bricks are: little touches anything outside.
std::vector<RankedPart> split_into_slabs(std::mt19937_64& random,
                                         const std::vector<RankedPoint>& ordered, const Box& box,
                                         std::size_t slabs) {
    std::vector<std::vector<RankedPoint>> runs(slabs);
    std::vector<RankedPart> parts(slabs);
    for (const RankedPoint& point : ordered) {
        const double at = (point.position.x - box.min.x) / (box.max.x - box.min.x);
        const std::size_t slab =
            std::min(slabs - 1, static_cast<std::size_t>(at * static_cast<double>(slabs)));
        runs[slab].push_back(point);
        parts[slab].box.extend(point.position);
        ++parts[slab].points;
    }
    for (std::size_t slab = 0; slab < slabs; ++slab) {
        parts[slab].runs.push_back(std::make_unique<Blocks>(std::move(runs[slab]), random()));
    }
    return parts;
}

// Each point has points of the other part all round it, so that everything stays open.
std::vector<RankedPart> split_in_two(const std::vector<RankedPoint>& ordered, const Box& box) {
    std::vector<std::vector<RankedPoint>> runs(2);
    for (std::size_t i = 0; i < ordered.size(); ++i) {
        runs[i % 2].push_back(ordered[i]);
    }
    std::vector<RankedPart> parts(2);
    for (std::size_t i = 0; i < 2; ++i) {
        parts[i].box = box;
        parts[i].points = runs[i].size();
        parts[i].runs.push_back(std::make_unique<Blocks>(std::move(runs[i]), i));
    }
    return parts;
}

std::vector<RankedPart> one_part(std::unique_ptr<RankedStream> run, const Box& box,
                                 std::uint64_t points) {
    std::vector<RankedPart> parts(1);
    parts[0].box = box;
    parts[0].points = points;
    parts[0].runs.push_back(std::move(run));
    return parts;
}

struct Ranked {
    std::vector<RankedPoint> ordered;
    Box box;
    std::uint64_t ids = 0;
    double mean = 0;
};

// Random curvatures, many equal or zero, in the method's order.
Ranked rank_at_random(std::mt19937_64& random, const std::vector<Vec3>& cloud) {
    const test::Points points = test::finite_points(cloud);
    Ranked ranked{{}, points.box, cloud.size(), 0};
    for (std::size_t i = 0; i < points.ids.size(); ++i) {
        const double key =
            random() % 4 == 0 ? static_cast<double>(random() % 3)
                              : std::pow(10, std::uniform_real_distribution<double>(-3, 3)(random));
        ranked.ordered.push_back({key, points.ids[i], points.positions[i]});
        if (random() % 8 != 0) {
            ranked.ordered.back().frame =
                PackedFrame(PackedFrame::Bytes{static_cast<std::uint8_t>(random() % 255),
                                               static_cast<std::uint8_t>(random() % 255),
                                               static_cast<std::uint8_t>(random() % 256)});
        }
        ranked.mean += key / static_cast<double>(points.ids.size());
    }
    std::sort(ranked.ordered.begin(), ranked.ordered.end(),
              [](const RankedPoint& a, const RankedPoint& b) {
                  return std::pair(-a.key, splitmix64(a.id)) < std::pair(-b.key, splitmix64(b.id));
              });
    return ranked;
}

RangeParams random_range(std::mt19937_64& random, const Box& box) {
    const double diagonal = box.diagonal() > 0 ? box.diagonal() : 1;
    RangeParams range;
    range.alpha =
        random() % 4 == 0
            ? 0.1
            : diagonal * std::pow(10, std::uniform_real_distribution<double>(-3, -0.5)(random));
    range.min_factor = random() % 2 == 0 ? 1.0 / 3 : 0.01;
    range.max_factor = random() % 2 == 0 ? kInfinity : 8;
    std::uniform_real_distribution<double> unit(0, 1);
    range.slab = random() % 3 == 0 ? unit(random) : 0;
    range.aspect = random() % 3 == 0 ? 1 + 3 * unit(random) : 1;
    return range;
}

// Section 4 of the method, word for word.
std::vector<PointId> walk(const Ranked& ranked, const RangeParams& range) {
    struct Kept {
        Vec3 position;
        Region region;
    };
    const RegionShape shape(range);
    std::vector<Kept> kept;
    std::vector<PointId> ids;
    for (const RankedPoint& p : ranked.ordered) {
        const bool marked = std::any_of(kept.begin(), kept.end(), [&](const Kept& q) {
            return squared_distance(p.position, q.position) <= q.region.reach * q.region.reach &&
                   (shape.is_ball() || holds(q.region, shape, p.position - q.position));
        });
        if (marked) {
            continue;
        }
        const double wanted = p.key > 0 ? range.alpha * ranked.mean / p.key : kInfinity;
        const double r = std::min(std::max(wanted, range.alpha * range.min_factor),
                                  range.alpha * range.max_factor);
        const double flatness =
            p.frame.is_none() ? 1 : std::min(p.frame.frame().flatness, range.aspect);
        kept.push_back({p.position, {r, r * std::sqrt(flatness), p.key, p.frame}});
        ids.push_back(p.id);
    }
    std::sort(ids.begin(), ids.end());
    return ids;
}

std::vector<PointId> ids_of(const Selection& selection) {
    std::vector<PointId> ids;
    for (PointId id = 0; id < selection.size(); ++id) {
        if (selection.test(id)) {
            ids.push_back(id);
        }
    }
    return ids;
}

MergeRequest request_for(const Ranked& ranked, const RangeParams& range) {
    return {.range = range,
            .mean_curvature = ranked.mean,
            .points = ranked.ids,
            .box = ranked.box,
            .budget_bytes = kNoLimit};
}

TEST(Merge, EqualsTheBruteForceWalkHoweverTheStreamsAreSplit) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 1000; ++round) {
        const Ranked ranked = rank_at_random(random, test::random_cloud(random));
        const RangeParams range = random_range(random, ranked.box);
        std::uint64_t told = 0;
        const MergeResult merged =
            merge(split_at_random(random, ranked.ordered), request_for(ranked, range),
                  [&](std::uint64_t n) { told += n; });
        ASSERT_EQ(ids_of(merged.selection), walk(ranked, range)) << "round " << round;
        ASSERT_EQ(merged.kept, merged.selection.count());
        ASSERT_EQ(merged.kept + merged.represented, ranked.ordered.size());
        ASSERT_EQ(told, ranked.ordered.size());
    }
}

TEST(Merge, EqualsTheBruteForceWalkOverManyBatchesForAnyThreadCount) {
    std::mt19937_64 random(2);
    const Ranked ranked = rank_at_random(random, test::sphere_cloud(60000, 5));
    const RangeParams range{.alpha = 0.05, .min_factor = 0.3, .max_factor = 4};
    const std::vector<PointId> expected = walk(ranked, range);
    ASSERT_GT(expected.size(), 500U);
    for (const int threads : {1, 2, 4}) {
        const ThreadLimit limit(threads);
        const MergeResult merged = merge(split_at_random(random, ranked.ordered),
                                         request_for(ranked, range), [](std::uint64_t) {});
        EXPECT_EQ(ids_of(merged.selection), expected) << threads << " threads";
    }
}

TEST(Merge, SettlesMostOfABrickWithoutTheOthers) {
    std::mt19937_64 random(5);
    const Ranked ranked = rank_at_random(random, test::sphere_cloud(200000, 5));
    const RangeParams range{.alpha = 0.02, .min_factor = 0.3, .max_factor = 2};
    const std::vector<PointId> expected = walk(ranked, range);
    for (const std::size_t slabs : {1, 2, 5}) {
        MergeRequest request = request_for(ranked, range);
        std::mutex mutex;
        std::size_t open = 0;
        std::vector<int> settled(slabs);
        std::vector<PointId> told;
        const auto take = [&](std::span<const RankedPoint> kept) {
            EXPECT_TRUE(std::is_sorted(
                kept.begin(), kept.end(),
                [](const RankedPoint& a, const RankedPoint& b) { return ranks_before(a, b); }));
            for (const RankedPoint& point : kept) {
                told.push_back(point.id);
            }
        };
        request.on_settled = [&](std::size_t part, std::span<const RankedPoint> kept,
                                 std::vector<RankedPoint> points) {
            const std::scoped_lock lock(mutex);
            open += points.size();
            ++settled[part];
            take(kept);
            return hold_in_memory(part, kept, std::move(points));
        };
        request.on_walked = take;
        const MergeResult merged =
            merge(split_into_slabs(random, ranked.ordered, ranked.box, slabs), request,
                  [](std::uint64_t) {});
        EXPECT_EQ(ids_of(merged.selection), expected) << slabs << " slabs";
        std::sort(told.begin(), told.end());
        EXPECT_EQ(told, expected) << "each is told once";
        EXPECT_EQ(settled, std::vector<int>(slabs, 1));
        if (slabs == 1) {
            EXPECT_EQ(open, 0U) << "nothing is outside";
        } else {
            EXPECT_GT(open, 0U);
            EXPECT_LT(open, ranked.ordered.size() / 2);
        }
    }
}

TEST(Merge, AnInfiniteRangeErasesAllThatComesAfter) {
    const std::vector<RankedPoint> ordered{{2, 0, {0, 0, 0}}, {0, 1, {5, 0, 0}}, {0, 2, {9, 0, 0}}};
    Box box;
    for (const RankedPoint& p : ordered) {
        box.extend(p.position);
    }
    // splitmix64(1) < splitmix64(2): the order of equal keys.
    ASSERT_LT(splitmix64(1), splitmix64(2));
    const MergeResult merged =
        merge(one_part(std::make_unique<Blocks>(ordered, 1), box, ordered.size()),
              {.range = {.alpha = 1, .min_factor = 0.5, .max_factor = kInfinity},
               .mean_curvature = 1,
               .points = 3,
               .box = box,
               .budget_bytes = kNoLimit},
              [](std::uint64_t) {});
    EXPECT_EQ(ids_of(merged.selection), (std::vector<PointId>{0, 1}));
    EXPECT_EQ(merged.represented, 1U);
}

TEST(Merge, OfNothingKeepsNothing) {
    const MergeResult merged = merge({}, {.range = {.alpha = 1}, .box = {}}, [](std::uint64_t) {});
    EXPECT_EQ(merged.kept, 0U);
    EXPECT_EQ(merged.represented, 0U);
    EXPECT_EQ(merged.selection.size(), 0U);
}

TEST(Merge, WithoutMemoryForTheKeptPointsIsAStorageErrorWithTheFigures) {
    std::mt19937_64 random(3);
    const Ranked ranked = rank_at_random(random, test::sphere_cloud(20000, 5));
    MergeRequest request = request_for(ranked, {.alpha = 1e-6});
    request.budget_bytes = 100'000;
    using testing::AllOf;
    using testing::HasSubstr;
    EXPECT_THAT(
        [&] { merge(split_in_two(ranked.ordered, ranked.box), request, [](std::uint64_t) {}); },
        testing::ThrowsMessage<StorageError>(AllOf(HasSubstr("97.66 KiB given"),
                                                   HasSubstr("4096 of them"),
                                                   HasSubstr("resources.memory"))));
}

TEST(Merge, HandsOnWhatAStreamThrows) {
    class Torn final : public RankedStream {
        bool next(std::vector<RankedPoint>&) override { throw StorageError("run: torn"); }
    };
    EXPECT_THROW(merge(one_part(std::make_unique<Torn>(), {}, 1),
                       {.range = {.alpha = 1}, .box = {}}, [](std::uint64_t) {}),
                 StorageError);
}

TEST(RangeLaw, NeverDecreasesAlongTheOrderAndStaysWithinItsFactors) {
    std::mt19937_64 random(4);
    for (int round = 0; round < 10000; ++round) {
        Box box;
        const RangeParams range = random_range(random, box);
        const double mean = std::pow(10, std::uniform_real_distribution<double>(-9, 9)(random));
        const auto any = [&] {
            return random() % 9 == 0 ? 0
                                     : mean * std::pow(10, std::uniform_real_distribution<double>(
                                                               -300, 290)(random));
        };
        const double a = any();
        const double b = any();
        const RangeLaw law(range, mean);
        EXPECT_LE(law.of(std::max(a, b)), law.of(std::min(a, b)));
        EXPECT_GE(law.of(a), range.alpha * range.min_factor);
        EXPECT_LE(law.of(a), range.alpha * range.max_factor);
    }
    EXPECT_EQ(RangeLaw({.alpha = 0.25}, 3).of(3), 0.25) << "alpha is the range at mean curvature";
    EXPECT_EQ(RangeLaw({.alpha = 0.25}, 0).of(0), 2.0) << "a cloud without curvature";
}

}  // namespace
}  // namespace knap
