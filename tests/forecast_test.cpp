#include "pipeline/forecast.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "base/file.hpp"
#include "base/scratch.hpp"
#include "knap/error.hpp"
#include "rank/held_bricks.hpp"
#include "support/clouds.hpp"

namespace knap {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

// A job of a given size without files behind it.
SourceTable table_of(std::uint64_t points, std::uint64_t rejected, CoordinateKind kind) {
    SourceEntry entry;
    entry.points = points;
    entry.rejected = rejected;
    entry.info.coordinates.kind = kind;
    return {{entry}, {}};
}

Job random_job(std::mt19937_64& random) {
    Job job;
    job.output.path = "out";
    job.curvature.neighbours = static_cast<int>(3 + random() % 200);
    job.resources.memory_bytes = (256 + random() % 8000) * kMiB;
    job.resources.threads = static_cast<int>(1 + random() % 16);
    return job;
}

TEST(ShareMemory, NeverSharesOutMoreThanThereIs) {
    for (const std::uint64_t memory :
         {std::uint64_t{0}, kMiB, 256 * kMiB, 512 * kMiB, 4096 * kMiB, 1048576 * kMiB}) {
        const Budgets budgets = share_memory(memory);
        EXPECT_LE(budgets.stage, memory);
        EXPECT_LE(budgets.survey, memory);
    }
    const Budgets least = share_memory(256 * kMiB);
    EXPECT_GT(least.stage, 64 * kMiB) << "the least memory allowed leaves room to work";
    EXPECT_GT(least.survey, 16 * kMiB);
}

TEST(ShareMemory, GivesEveryStageMoreOfMore) {
    Budgets last;
    for (std::uint64_t memory = 256 * kMiB; memory <= 8192 * kMiB; memory += 64 * kMiB) {
        const Budgets budgets = share_memory(memory);
        EXPECT_GT(budgets.stage, last.stage);
        EXPECT_GE(budgets.survey, last.survey);
        last = budgets;
    }
}

TEST(PlanRequest, BricksOfAllThreadsFitTheMemory) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 1000; ++round) {
        const Job job = random_job(random);
        const Budgets budgets = share_memory(job.resources.memory_bytes);
        const SourceTable table =
            table_of(random() >> (20 + random() % 40), 0, CoordinateKind::kFloat32);
        const PlanRequest request = plan_request(job, table, budgets);
        EXPECT_EQ(request.neighbours, job.curvature.neighbours);
        EXPECT_GT(request.target_points, 0U);
        EXPECT_LE(request.target_points, request.most_points);
        const auto threads = static_cast<std::uint64_t>(job.resources.threads);
        EXPECT_LE(request.most_points * threads * rank_bytes_per_point(), budgets.stage);
    }
}

TEST(PlanRequest, AimsAtTheBrickSizeTheJobAsksFor) {
    Job job;
    job.resources.brick_points = 12345;
    const SourceTable table = table_of(10'000'000, 0, CoordinateKind::kFloat32);
    EXPECT_EQ(plan_request(job, table, share_memory(job.resources.memory_bytes)).target_points,
              12345U);
}

// A surveyed and planned archive in one file.
struct Archive {
    explicit Archive(std::uint64_t brick_points, bool text = false) {
        std::vector<Vec3> cloud = test::sphere_cloud(20000, 1);
        cloud[7].x = std::numeric_limits<double>::quiet_NaN();
        if (text) {
            test::write_ascii_ply(folder / "in.ply", cloud);
        } else {
            test::write_ply(folder / "in.ply", cloud, true);
        }
        job.output.path = (folder / "out").string();
        job.resources.threads = 2;
        job.resources.brick_points = brick_points;
        const Budgets budgets = share_memory(job.resources.memory_bytes);
        survey.emplace(knap::survey({.files = {folder / "in.ply"}, .budget_bytes = budgets.survey},
                                    [](std::uint64_t) {}));
        plan = plan_bricks(survey->occupancy, survey->table.box(),
                           plan_request(job, survey->table, budgets));
    }

    test::TemporaryFolder folder;
    Job job;
    std::optional<Survey> survey;
    BrickPlan plan;
};

TEST(MakeForecast, CountsThePositionsOfSlowSources) {
    const Archive records(300);
    const Archive text(300, true);
    const Forecast with = make_forecast(text.job, *text.survey, text.plan);
    const Forecast without = make_forecast(records.job, *records.survey, records.plan);
    ASSERT_EQ(with.bricks, without.bricks);
    const std::uint64_t positions = position_bytes(with.sources);
    EXPECT_EQ(positions, 20000U * 12);
    EXPECT_EQ(position_bytes(without.sources), 0U);
    EXPECT_EQ(with.scratch_bytes, without.scratch_bytes + positions / 16);
}

TEST(MakeForecast, AddsUpTheSurveyAndThePlan) {
    const Archive archive(1000);
    const Forecast forecast = make_forecast(archive.job, *archive.survey, archive.plan);
    EXPECT_EQ(forecast.points, 20000U);
    EXPECT_EQ(forecast.rejected, 1U);
    EXPECT_EQ(forecast.box, archive.survey->table.box());
    EXPECT_EQ(forecast.voxel_size, archive.plan.voxel_size);
    EXPECT_EQ(forecast.occupied_voxels, archive.survey->occupancy.voxel_count());
    EXPECT_EQ(forecast.bricks, archive.plan.bricks.size());
    EXPECT_EQ(forecast.sources.size(), 1U);
    std::uint64_t largest = 0;
    std::uint64_t halo = 0;
    std::uint64_t core = 0;
    for (const Brick& brick : archive.plan.bricks) {
        largest = std::max(largest, brick.core_points + brick.halo_points);
        halo += brick.halo_points;
        core += brick.core_points;
    }
    EXPECT_EQ(forecast.largest_brick, largest);
    EXPECT_EQ(forecast.halo_points, halo);
    EXPECT_GE(forecast.scratch_bytes, (core + halo) * 12) << "a packed position each";
    EXPECT_GT(forecast.scratch_free_bytes, 0U);
}

TEST(MakeForecast, NeedsMemoryForTheLargestBrickOfEveryThreadAtATime) {
    Archive archive(1000);
    archive.job.resources.memory_bytes = std::uint64_t{3} << 30;
    archive.plan.bricks.resize(3);
    archive.plan.bricks[0].core_points = 10'000'000;
    archive.plan.bricks[1].core_points = 1'000'000;
    archive.plan.bricks[2].core_points = 18'000'000;
    archive.plan.bricks[2].halo_points = 2'000'000;
    std::uint64_t last = 0;
    for (const auto& [threads, points] :
         {std::pair{1, 20'000'000U}, std::pair{2, 30'000'000U}, std::pair{3, 31'000'000U}}) {
        archive.job.resources.threads = threads;
        const Forecast forecast = make_forecast(archive.job, *archive.survey, archive.plan);
        EXPECT_EQ(forecast.largest_brick, 20'000'000U);
        EXPECT_GE(forecast.memory_bytes, points * rank_bytes_per_point());
        EXPECT_GT(forecast.memory_bytes, last);
        last = forecast.memory_bytes;
    }
}

TEST(MakeForecast, OfNothingNeedsNoScratch) {
    Archive archive(1000);
    archive.survey.emplace(Survey{SourceTable(), Occupancy(1, kMiB), {}});
    archive.plan.bricks.clear();
    const Forecast forecast = make_forecast(archive.job, *archive.survey, archive.plan);
    EXPECT_EQ(forecast.points, 0U);
    EXPECT_EQ(forecast.largest_brick, 0U);
    EXPECT_EQ(forecast.scratch_bytes, 0U);
}

TEST(CheckForecast, LetsPassWhatJustFits) {
    Job job;
    job.resources.memory_bytes = 300 * kMiB;
    Forecast forecast;
    forecast.memory_bytes = 300 * kMiB;
    forecast.scratch_bytes = forecast.scratch_free_bytes = 1000;
    EXPECT_NO_THROW(check_forecast(forecast, job, "/scratch"));
}

TEST(CheckForecast, RefusesWhatNeedsMoreMemoryWithTheFigures) {
    Job job;
    job.resources.memory_bytes = 300 * kMiB;
    Forecast forecast;
    forecast.memory_bytes = 301 * kMiB;
    forecast.largest_brick = 777;
    EXPECT_THAT(
        [&] { check_forecast(forecast, job, "/scratch"); },
        ThrowsMessage<StorageError>(AllOf(HasSubstr("resources.memory"), HasSubstr("301.00 MiB"),
                                          HasSubstr("300.00 MiB"), HasSubstr("777 points"))));
}

TEST(CheckForecast, RefusesWhatNeedsMoreScratchNamingTheFolderWithTheFigures) {
    Forecast forecast;
    forecast.scratch_bytes = 2048;
    forecast.scratch_free_bytes = 1024;
    EXPECT_THAT([&] { check_forecast(forecast, Job{}, "/scratch"); },
                ThrowsMessage<StorageError>(
                    AllOf(HasSubstr("/scratch"), HasSubstr("2.00 KiB"), HasSubstr("1.00 KiB"))));
}

TEST(ScratchParent, IsWhatTheJobSaysOrBesideTheOutput) {
    Job job;
    job.output.path = "/a/b/out";
    EXPECT_EQ(scratch_parent(job), "/a/b");
    job.output.path = "/a/b/out/";
    EXPECT_EQ(scratch_parent(job), "/a/b");
    job.output.path = "out.ply";
    EXPECT_EQ(scratch_parent(job), std::filesystem::current_path());
    job.resources.scratch = "/fast/disk";
    EXPECT_EQ(scratch_parent(job), "/fast/disk");
}

}  // namespace
}  // namespace knap
