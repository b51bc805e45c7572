#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>

#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "knap/job.hpp"
#include "support/archive_bytes.hpp"
#include "support/clouds.hpp"
#include "support/random_params.hpp"
#include "support/reference.hpp"

namespace knap {
namespace {

class Silent final : public Progress {};

Report run_silently(const Job& job) {
    Silent progress;
    return run(job, progress);
}

Job job_for(const test::TemporaryFolder& folder, const std::string& input,
            const SimplifyParams& params) {
    Job job;
    job.input = {(folder / input).string()};
    job.curvature = params.curvature;
    job.range = params.range;
    job.output.path = (folder / "out").string();
    job.output.ids = (folder / "ids").string();
    job.output.overwrite = true;
    job.resources.memory_bytes = std::uint64_t{512} << 20;
    job.resources.threads = params.threads;
    return job;
}

TEST(Run, EqualsTheBruteForceReferenceForAnyBrickSize) {
    std::mt19937_64 random(1848);
    const test::TemporaryFolder folder;
    for (int round = 0; round < 500; ++round) {
        const std::vector<Vec3> cloud = test::random_cloud(random);
        const SimplifyParams params = test::random_params(random, cloud);
        const reference::Result expected =
            reference::simplify(cloud, params.curvature, params.range);
        test::write_ply(folder / "in.ply", cloud);
        Job job = job_for(folder, "in.ply", params);
        job.output.path = (folder / "out.ply").string();
        job.resources.brick_points = std::uniform_int_distribution<std::uint64_t>(1, 300)(random);
        const Report report = run_silently(job);
        ASSERT_EQ(test::read_ids(folder / "ids"), expected.kept)
            << "round " << round << ", " << cloud.size() << " points in " << report.bricks
            << " bricks, " << report.stragglers << " stragglers";
        EXPECT_EQ(report.counts, (Counts{cloud.size(), expected.kept.size(), expected.represented,
                                         expected.merged, expected.rejected}));
        EXPECT_EQ(report.spacing, expected.spacing);
        EXPECT_EQ(report.mean_curvature, expected.mean_curvature);
    }
}

TEST(Run, ACountIsMetWithTheSamePointsForAnyCut) {
    const test::TemporaryFolder folder;
    const std::vector<Vec3> cloud = test::sphere_cloud(20000, 9);
    test::write_ply(folder / "in.ply", cloud);
    SimplifyParams params;
    params.range.count = 3000;
    const SimplifyResult expected = simplify(cloud, params);
    EXPECT_NEAR(static_cast<double>(expected.counts.kept), 3000, 30);
    std::string bytes;
    for (const std::uint64_t brick_points : {200U, 1500U, 100000U}) {
        for (const int threads : {1, 3}) {
            params.threads = threads;
            Job job = job_for(folder, "in.ply", params);
            job.resources.brick_points = brick_points;
            const Report report = run_silently(job);
            EXPECT_EQ(test::read_ids(folder / "ids"), expected.kept);
            EXPECT_EQ(report.alpha, expected.alpha);
            const std::string found = test::archive_bytes(folder / "out");
            EXPECT_TRUE(bytes.empty() || found == bytes);
            bytes = found;
        }
    }
}

TEST(Run, EqualsTheBruteForceReferenceOnTheDragon) {
    const test::TemporaryFolder folder;
    const std::filesystem::path dragon = test::shared_file("scans/dragon_vrip.ply.gz", folder);
    if (dragon.empty()) {
        GTEST_SKIP() << "needs ../shared/data/scans/dragon_vrip.ply.gz";
    }
    SimplifyParams params;
    params.range.alpha = 0.002;
    std::vector<Vec3> cloud = test::read_cloud(dragon);
    // Half of it takes the reference a quarter of the time.
    if (std::getenv("KNAP_WHOLE_DRAGON") == nullptr) {
        std::erase_if(cloud, [](const Vec3& p) { return p.x > -0.02; });
        ASSERT_GT(cloud.size(), 150000U);
    }
    test::write_ply(folder / "dragon.ply", cloud, true);
    const reference::Result expected = reference::simplify(cloud, params.curvature, params.range);
    Job job = job_for(folder, "dragon.ply", params);
    job.resources.brick_points = 10000;
    const Report report = run_silently(job);
    EXPECT_GT(report.bricks, 20U);
    EXPECT_EQ(test::read_ids(folder / "ids"), expected.kept);
    EXPECT_EQ(report.counts.merged, expected.merged);
    EXPECT_EQ(report.spacing, expected.spacing);
    EXPECT_EQ(report.mean_curvature, expected.mean_curvature);
}

TEST(Run, WritesTheSameBytesForAnyBricksThreadsAndMemory) {
    const test::TemporaryFolder folder;
    test::write_ply(folder / "in.ply", test::sphere_cloud(30000, 3), true);
    SimplifyParams params;
    params.range.alpha = 0.03;
    Job job = job_for(folder, "in.ply", params);
    job.output.tile_points = 1000;
    std::string expected;
    for (const std::uint64_t brick_points : {30000, 3000, 100}) {
        for (const int threads : {1, 2, 4}) {
            for (const std::uint64_t mebibytes : {512, 4096}) {
                job.resources = {.memory_bytes = mebibytes << 20,
                                 .threads = threads,
                                 .scratch = "",
                                 .brick_points = brick_points};
                const Report report = run_silently(job);
                EXPECT_GT(report.tiles, 3U);
                const std::string bytes = test::archive_bytes(job.output.path);
                if (expected.empty()) {
                    expected = bytes;
                }
                ASSERT_EQ(bytes == expected, true) << report.bricks << " bricks, " << threads
                                                   << " threads, " << mebibytes << " MiB";
            }
        }
    }
}

TEST(Run, ManyFilesKeepTheSamePointsAsOne) {
    const test::TemporaryFolder folder;
    const std::vector<Vec3> cloud = test::sphere_cloud(9000, 11);
    test::write_ply(folder / "whole.ply", cloud);
    std::filesystem::create_directory(folder / "parts");
    for (std::size_t part = 0; part < 3; ++part) {
        const auto begin = cloud.begin() + static_cast<std::ptrdiff_t>(part * 3000);
        test::write_ply(folder / ("parts/" + std::to_string(part) + ".ply"), {begin, begin + 3000});
    }
    SimplifyParams params;
    params.range.alpha = 0.05;
    run_silently(job_for(folder, "whole.ply", params));
    const std::vector<PointId> expected = test::read_ids(folder / "ids");
    run_silently(job_for(folder, "parts", params));
    EXPECT_EQ(test::read_ids(folder / "ids"), expected);
}

TEST(Run, LeavesNoScratchBehind) {
    const test::TemporaryFolder folder;
    test::write_ply(folder / "in.ply", test::sphere_cloud(3000, 5));
    SimplifyParams params;
    params.range.alpha = 0.05;
    Job job = job_for(folder, "in.ply", params);
    job.output.ids.clear();
    run_silently(job);
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
        names.push_back(entry.path().filename().string());
    }
    std::sort(names.begin(), names.end());
    EXPECT_EQ(names, (std::vector<std::string>{"in.ply", "out"}));
}

TEST(Run, AFailedJobLeavesNothingBehind) {
    const test::TemporaryFolder folder;
    std::string bytes;
    test::write_ply(folder / "whole.ply", test::sphere_cloud(3000, 5));
    std::filesystem::copy(folder / "whole.ply", folder / "in.ply");
    std::filesystem::resize_file(folder / "in.ply",
                                 std::filesystem::file_size(folder / "in.ply") - 10);
    std::filesystem::remove(folder / "whole.ply");
    SimplifyParams params;
    params.range.alpha = 0.05;
    EXPECT_THROW(run_silently(job_for(folder, "in.ply", params)), InputError);
    const auto files = std::distance(std::filesystem::directory_iterator(folder.path()), {});
    EXPECT_EQ(files, 1) << "only the input is left";
}

TEST(Forecast, RefusesAJobThatDoesNotFitTheMemory) {
    const test::TemporaryFolder folder;
    // All in one voxel, which cannot be split: a point far away makes voxels large.
    std::vector<Vec3> cloud = test::sphere_cloud(3'000'000, 5);
    for (Vec3& p : cloud) {
        p = p + Vec3{2, 2, 2};
    }
    cloud.front() = {1e9, 0, 0};
    test::write_ply(folder / "in.ply", cloud);
    SimplifyParams params;
    params.range.alpha = 1;
    Job job = job_for(folder, "in.ply", params);
    job.resources.memory_bytes = std::uint64_t{256} << 20;
    try {
        run_silently(job);
        FAIL() << "expected a StorageError";
    } catch (const StorageError& error) {
        EXPECT_NE(std::string(error.what()).find("resources.memory"), std::string::npos)
            << error.what();
    }
}

}  // namespace
}  // namespace knap
