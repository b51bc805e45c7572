#include "rank/rank.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <random>

#include "base/threads.hpp"
#include "store/brick_file.hpp"
#include "store/ranked_run.hpp"
#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"
#include "support/damage.hpp"
#include "support/reference.hpp"

namespace knap {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kAmple = std::uint64_t{1} << 30;
constexpr test::Halo kHalos[] = {test::Halo::kPlanned, test::Halo::kNone, test::Halo::kAll};

SourceTable table_of(const std::vector<Vec3>& cloud, const Box& box) {
    SourceEntry entry;
    entry.points = cloud.size();
    for (const Vec3& p : cloud) {
        entry.rejected += is_finite(p) ? 0 : 1;
    }
    return {{entry}, box};
}

// Writes one part of a brick as blocks, whose ids must ascend.
void append_part(const fs::path& path, const SourceTable& table, BrickPart part,
                 const BrickPoints& points, std::size_t begin, std::size_t end) {
    std::map<PointId, Vec3> sorted;
    for (std::size_t i = begin; i < end; ++i) {
        sorted[points.ids[i]] = points.positions[i];
    }
    BrickBlock block;
    block.part = part;
    for (const auto& [id, position] : sorted) {
        block.add(table, id, position);
        if (block.count == 50) {
            append_block(path, block);
            block.clear();
        }
    }
    if (block.count > 0) {
        append_block(path, block);
    }
}

std::vector<BrickFile> write_bricks(const fs::path& folder, const SourceTable& table,
                                    const test::CutCloud& cut) {
    std::vector<BrickFile> files;
    for (const test::CutBrick& brick : cut.bricks) {
        const BrickPoints& points = brick.points;
        BrickFile file{.path = folder / (std::to_string(files.size()) + ".brick"),
                       .brick = brick.brick,
                       .core_box = brick.core_box};
        file.core_points = points.core_count;
        file.halo_points = points.ids.size() - points.core_count;
        create_brick_file(file.path, table);
        append_part(file.path, table, BrickPart::kHalo, points, points.core_count,
                    points.ids.size());
        append_part(file.path, table, BrickPart::kCore, points, 0, points.core_count);
        file.bytes = fs::file_size(file.path);
        files.push_back(file);
    }
    return files;
}

std::vector<fs::path> runs_of(const RankResult& ranked) {
    std::vector<fs::path> runs;
    for (const RankedFiles& brick : ranked.bricks) {
        runs.insert(runs.end(), brick.runs.begin(), brick.runs.end());
    }
    return runs;
}

std::map<PointId, double> read_runs(const RankResult& ranked, const SourceTable& table) {
    std::map<PointId, double> curvature;
    for (const fs::path& path : runs_of(ranked)) {
        RunReader reader(path, table);
        std::vector<RankedPoint> all;
        for (std::vector<RankedPoint> block; reader.next(block);) {
            all.insert(all.end(), block.begin(), block.end());
        }
        EXPECT_TRUE(std::is_sorted(
            all.begin(), all.end(),
            [](const RankedPoint& a, const RankedPoint& b) { return ranks_before(a, b); }));
        for (const RankedPoint& point : all) {
            EXPECT_TRUE(curvature.emplace(point.id, point.key).second) << "each point in one run";
        }
    }
    return curvature;
}

struct Outcome {
    RankResult result;
    std::vector<fs::path> runs;
    std::map<PointId, double> curvature;
};

Outcome rank_cut(const std::vector<Vec3>& cloud, const test::CutCloud& cut,
                 const CurvatureParams& params, std::uint64_t budget = kAmple) {
    const test::TemporaryFolder folder;
    const SourceTable table = table_of(cloud, cut.box);
    const std::vector<BrickFile> files = write_bricks(folder.path(), table, cut);
    std::atomic<std::int64_t> scratch{0};
    std::uint64_t core_points = 0;
    for (const BrickFile& file : files) {
        scratch += static_cast<std::int64_t>(file.bytes);
        core_points += file.core_points;
    }
    std::atomic<std::uint64_t> told{0};
    Outcome outcome;
    Ranking ranking(table, files,
                    {.folder = folder.path(),
                     .curvature = params,
                     .budget_bytes = budget,
                     .on_scratch = [&](std::int64_t bytes) { scratch += bytes; }});
    const auto tell = [&](std::uint64_t points) { told += points; };
    const double spacing = ranking.measure_spacing(tell);
    EXPECT_EQ(told.exchange(0), core_points);
    outcome.result = ranking.rank(spacing, tell);
    EXPECT_EQ(told, core_points);
    std::int64_t left = 0;
    for (const auto& entry : fs::directory_iterator(folder.path())) {
        left += static_cast<std::int64_t>(entry.file_size());
    }
    EXPECT_EQ(scratch, left) << "what scratch takes is told as it changes";
    outcome.runs = runs_of(outcome.result);
    std::uint64_t points = 0;
    for (const RankedFiles& brick : outcome.result.bricks) {
        points += brick.points;
    }
    EXPECT_EQ(points, outcome.result.points);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), std::ssize(outcome.runs))
        << "brick files are gone, only runs are left";
    outcome.curvature = read_runs(outcome.result, table);
    EXPECT_EQ(outcome.curvature.size(), outcome.result.points);
    return outcome;
}

TEST(Rank, IsTheSameForAnyCutIntoBricks) {
    std::mt19937_64 random(1);
    std::uint64_t stragglers = 0;
    for (int round = 0; round < 60; ++round) {
        const std::vector<Vec3> cloud = test::random_cloud(random);
        const test::Points points = test::finite_points(cloud);
        CurvatureParams params;
        params.neighbours = static_cast<int>(3 + random() % 60);
        const Outcome whole =
            rank_cut(cloud, test::cut_cloud(random, points, kAmple, test::Halo::kAll), params);
        EXPECT_EQ(whole.result.stragglers, 0U);
        const ThreadLimit limit(1 + round % 3);
        const Outcome cut = rank_cut(
            cloud, test::cut_cloud(random, points, 1 + random() % 300, kHalos[round % 3]), params);
        stragglers += cut.result.stragglers;
        ASSERT_EQ(cut.curvature, whole.curvature) << "bit for bit, round " << round;
        ASSERT_EQ(cut.result.spacing, whole.result.spacing);
        ASSERT_EQ(cut.result.mean_curvature, whole.result.mean_curvature);
        ASSERT_EQ(cut.result.merged, whole.result.merged);
    }
    EXPECT_GT(stragglers, 1000U);
}

TEST(Rank, EqualsTheBruteForceReference) {
    std::mt19937_64 random(2);
    for (int round = 0; round < 60; ++round) {
        const std::vector<Vec3> cloud = test::random_cloud(random);
        const test::Points points = test::finite_points(cloud);
        const reference::Result expected = reference::simplify(cloud, {}, {.alpha = 1});
        const Outcome found = rank_cut(
            cloud, test::cut_cloud(random, points, 1 + random() % 300, kHalos[round % 3]), {});
        ASSERT_EQ(found.result.spacing, expected.spacing) << "round " << round;
        ASSERT_EQ(found.result.mean_curvature, expected.mean_curvature);
        ASSERT_EQ(found.result.merged, expected.merged);
        ASSERT_EQ(found.result.points, points.ids.size() - expected.merged);
    }
}

TEST(Rank, DoesNotDependOnItsBudgetEvenWhereStragglersComeInManyGroups) {
    std::mt19937_64 random(3);
    const std::vector<Vec3> cloud = test::sphere_cloud(3000, 4);
    const test::CutCloud cut =
        test::cut_cloud(random, test::finite_points(cloud), 300, test::Halo::kNone);
    const Outcome ample = rank_cut(cloud, cut, {});
    const Outcome tight = rank_cut(cloud, cut, {}, 1'000'000);
    EXPECT_EQ(tight.curvature, ample.curvature);
    EXPECT_EQ(tight.result.mean_curvature, ample.result.mean_curvature);
    EXPECT_GT(tight.runs.size(), ample.runs.size());
}

TEST(Rank, OfNothingHasNoRuns) {
    const Outcome nothing = rank_cut({}, {}, {});
    EXPECT_TRUE(nothing.runs.empty());
    EXPECT_EQ(nothing.result.spacing, 0);
    EXPECT_EQ(nothing.result.mean_curvature, 0);
}

class DamagedBrick : public testing::Test {
  protected:
    void damage(const std::string& bytes) { test::write_bytes(files_[1].path, bytes); }
    bool refused() {
        return test::refuses(files_[1].path, [&] {
            const auto nobody = [](std::uint64_t) {};
            Ranking ranking(table_, files_,
                            {.folder = folder_.path(), .curvature = {}, .budget_bytes = kAmple});
            ranking.rank(ranking.measure_spacing(nobody), nobody);
        });
    }

    test::TemporaryFolder folder_;
    std::mt19937_64 random_{5};
    std::vector<Vec3> cloud_ = test::sphere_cloud(1000, 4);
    test::CutCloud cut_ =
        test::cut_cloud(random_, test::finite_points(cloud_), 300, test::Halo::kPlanned);
    SourceTable table_ = table_of(cloud_, cut_.box);
    std::vector<BrickFile> files_ = write_bricks(folder_.path(), table_, cut_);
};

TEST_F(DamagedBrick, IsAnErrorNamingIt) {
    std::string bytes = test::read_bytes(files_[1].path);
    bytes[bytes.size() / 2] ^= 4;
    damage(bytes);
    EXPECT_TRUE(refused());
}

TEST_F(DamagedBrick, ThatLostWholeBlocksIsAnErrorNamingIt) {
    const std::string bytes = test::read_bytes(files_[1].path);
    constexpr std::size_t kHeaderOnly = 16;
    damage(bytes.substr(0, kHeaderOnly));
    EXPECT_TRUE(refused());
}

TEST_F(DamagedBrick, ThatIsMissingIsAnErrorNamingIt) {
    fs::remove(files_[1].path);
    EXPECT_TRUE(refused());
}

TEST_F(DamagedBrick, NoneOfThemIsNoError) {
    EXPECT_FALSE(refused());
}

}  // namespace
}  // namespace knap
