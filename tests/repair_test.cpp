#include "pipeline/repair.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "knap/simplify.hpp"
#include "support/resume_fixture.hpp"
#include "surface/fan_surface.hpp"

namespace knap {
namespace {

using test::stop_in;

// A sheet with a ridge, rough by `noise`.
std::vector<Vec3> ridge(std::size_t points, double noise) {
    std::mt19937_64 random(17);
    std::uniform_real_distribution<double> unit(-1, 1);
    std::vector<Vec3> cloud(points);
    for (Vec3& p : cloud) {
        p = {unit(random), unit(random), 0};
        p.z = 0.3 * std::exp(-40 * p.x * p.x) + noise * unit(random);
    }
    return cloud;
}

Job accurate(std::uint64_t count) {
    Job job;
    apply_preset(job, "accurate");
    job.range.count = count;
    return job;
}

std::vector<double> distances(const std::vector<Vec3>& cloud, const std::vector<PointId>& kept) {
    std::vector<Vec3> points;
    for (const PointId id : kept) {
        points.push_back(cloud[id]);
    }
    const FanSurface surface(points);
    std::vector<double> found;
    for (const Vec3& p : cloud) {
        found.push_back(surface.nearest(p).distance);
    }
    std::sort(found.begin(), found.end());
    return found;
}

double root_mean_square(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) {
        sum += value * value;
    }
    return std::sqrt(sum / static_cast<double>(values.size()));
}

TEST(Repair, BringsTheSurfaceNearerWithTheSameNumberOfPoints) {
    const std::vector<Vec3> cloud = ridge(20000, 0.002);
    Job job = accurate(1000);
    SimplifyParams params{.curvature = job.curvature, .range = job.range, .threads = 2};
    const SimplifyResult repaired = simplify(cloud, params);
    params.range.repair = 0;
    const SimplifyResult walked = simplify(cloud, params);
    EXPECT_EQ(repaired.counts.kept, 1000U);
    EXPECT_NEAR(static_cast<double>(walked.counts.kept), 1000, 10);
    const std::vector<double> with = distances(cloud, repaired.kept);
    const std::vector<double> without = distances(cloud, walked.kept);
    EXPECT_LT(root_mean_square(with), root_mean_square(without));
    EXPECT_LT(with[with.size() * 99 / 100], without[without.size() * 99 / 100]);
}

TEST(Repair, WithAToleranceNoPointIsFarther) {
    const std::vector<Vec3> cloud = ridge(20000, 0.002);
    Job job = accurate(0);
    for (const double tolerance : {0.003, 0.01, 0.03}) {
        job.range.tolerance = tolerance;
        const SimplifyParams params{.curvature = job.curvature, .range = job.range, .threads = 2};
        const SimplifyResult result = simplify(cloud, params);
        EXPECT_LE(distances(cloud, result.kept).back(), tolerance * (1 + 1e-9));
        EXPECT_LT(result.counts.kept, cloud.size() / 3);
    }
}

TEST(Repair, WithAnAlphaAddsTheShareThatIsAskedFor) {
    const std::vector<Vec3> cloud = ridge(20000, 0.002);
    Job job = accurate(0);
    job.range.alpha = 0.1;
    SimplifyParams params{.curvature = job.curvature, .range = job.range, .threads = 2};
    const SimplifyResult repaired = simplify(cloud, params);
    params.range.repair = 0;
    const SimplifyResult walked = simplify(cloud, params);
    EXPECT_EQ(repaired.alpha, walked.alpha);
    EXPECT_EQ(repaired.counts.kept, wanted_after_repair(job.range, walked.counts.kept));
    EXPECT_TRUE(std::includes(repaired.kept.begin(), repaired.kept.end(), walked.kept.begin(),
                              walked.kept.end()));
}

class RepairFiles : public test::ResumeFixture {
  protected:
    RepairFiles() {
        test::write_ply(folder_ / "in.ply", ridge(12000, 0.01), true);
        const Job accurately = accurate(0);
        job_.input = {(folder_ / "in.ply").string()};
        job_.curvature = accurately.curvature;
        job_.range = accurately.range;
        job_.range.alpha = 0.08;
        job_.resources.brick_points = 1500;
    }
};

TEST_F(RepairFiles, SameBytesForAnyBricksAndThreads) {
    std::string expected;
    for (const bool tolerated : {false, true}) {
        if (tolerated) {
            job_.range.alpha = 0;
            job_.range.tolerance = 0.012;
            expected.clear();
        }
        for (const std::uint64_t brick_points : {20000, 4000, 800}) {
            for (const int threads : {1, 3}) {
                job_.resources.brick_points = brick_points;
                job_.resources.threads = threads;
                const Report report = run_whole();
                const std::string found = result();
                EXPECT_TRUE(expected.empty() || found == expected)
                    << report.bricks << " bricks, " << threads << " threads";
                expected = found;
            }
        }
    }
}

TEST_F(RepairFiles, AJobStoppedAnywhereGoesOnToTheSameBytes) {
    run_whole();
    const std::string expected = result();
    int begun = 0;
    for (int calls = 0; calls < 120; calls += 17) {
        stop_in(job_, "repair", calls);
        begun += scratch_files(".suspects").empty() ? 0 : 1;
        run_whole();
        ASSERT_EQ(result() == expected, true) << "stopped at call " << calls;
    }
    EXPECT_GT(begun, 3);
}

TEST_F(RepairFiles, DoesNotMeasureAgainWhatIsMeasured) {
    const std::uint64_t bricks = run_whole().bricks;
    stop_in(job_, "repair", 45);
    const auto suspects = [&] {
        const std::string journal = test::read_bytes(scratch() / "journal");
        std::size_t count = 0;
        for (std::size_t at = journal.find(" suspects\t"); at != std::string::npos;
             at = journal.find(" suspects\t", at + 1)) {
            ++count;
        }
        return count;
    };
    const std::size_t before = suspects();
    EXPECT_GT(before, 3U);
    stop_in(job_, "emit", 0);
    EXPECT_EQ(suspects(), bricks) << "each brick once";
}

TEST_F(RepairFiles, DamagedFilesAreMadeAgain) {
    run_whole();
    const std::string expected = result();
    std::mt19937_64 random(5);
    for (const char* ending : {".suspects", ".copy"}) {
        stop_in(job_, "repair", 75);
        const std::vector<std::filesystem::path> files = scratch_files(ending);
        ASSERT_FALSE(files.empty()) << ending;
        for (const std::filesystem::path& file : files) {
            damage(random, file);
        }
        run_whole();
        EXPECT_EQ(result() == expected, true) << ending;
    }
}

}  // namespace
}  // namespace knap
