#include "emit/measures.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "knap/job.hpp"
#include "output/ply_writer.hpp"
#include "support/archive_bytes.hpp"
#include "support/clouds.hpp"

namespace knap {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;
using namespace test;

class Silent final : public Progress {};

/// Curvature and range of each point, by its place.
using ByPlace = std::map<std::tuple<double, double, double>, std::pair<float, float>>;

float float_at(const std::vector<std::byte>& column, std::size_t point) {
    float value = 0;
    std::memcpy(&value, column.data() + point * sizeof value, sizeof value);
    return value;
}

class MeasuresTest : public testing::Test {
  protected:
    MeasuresTest() {
        write_ply(folder_ / "in.ply", sphere_cloud(6000, 5), true);
        job_.input = {(folder_ / "in.ply").string()};
        job_.range.alpha = 0.08;
        job_.output.path = (folder_ / "out").string();
        job_.output.step = 1.0 / 1024;
        job_.output.measures = true;
        job_.output.overwrite = true;
        job_.output.tile_points = 1000;
        job_.resources.memory_bytes = std::uint64_t{512} << 20;
    }

    Report run_job() {
        Silent progress;
        return run(job_, progress);
    }

    ByPlace carried() const {
        const Archive archive(job_.output.path);
        EXPECT_EQ(archive.manifest().attributes.size(), 2U);
        EXPECT_EQ(archive.manifest().attributes[0].name, "curvature");
        EXPECT_EQ(archive.manifest().attributes[1].name, "range");
        ByPlace found;
        for (std::size_t i = 0; i < archive.manifest().tiles.size(); ++i) {
            const Tile tile = archive.read_whole_tile(i);
            for (std::size_t k = 0; k < tile.positions.size(); ++k) {
                const Vec3& p = tile.positions[k];
                found[{p.x, p.y, p.z}] = {float_at(tile.columns[0], k),
                                          float_at(tile.columns[1], k)};
            }
        }
        EXPECT_EQ(found.size(), archive.manifest().counts.kept);
        return found;
    }

    TemporaryFolder folder_;
    Job job_;
};

TEST_F(MeasuresTest, TheRangeFollowsFromTheCurvatureByTheLaw) {
    const Report report = run_job();
    for (const auto& [place, measures] : carried()) {
        const auto& [curvature, range] = measures;
        const double expected = report.alpha * report.mean_curvature / double{curvature};
        EXPECT_NEAR(range,
                    std::clamp(expected, report.alpha * job_.range.min_factor,
                               report.alpha * job_.range.max_factor),
                    1e-6 * range);
    }
}

// An independent look at the ranges: what a walk keeps stands in nobody else's range that came
// before, and those of larger curvature come first.
TEST_F(MeasuresTest, NoKeptPointIsInTheRangeOfOneOfLargerCurvature) {
    job_.range.alpha = 0.15;
    job_.output.step = 1e-9;
    run_job();
    const ByPlace found = carried();
    for (const auto& [a, first] : found) {
        for (const auto& [b, second] : found) {
            if (first.first > second.first) {
                const double x = std::get<0>(a) - std::get<0>(b);
                const double y = std::get<1>(a) - std::get<1>(b);
                const double z = std::get<2>(a) - std::get<2>(b);
                EXPECT_GT(std::sqrt(x * x + y * y + z * z), 0.9999 * first.second);
            }
        }
    }
}

TEST_F(MeasuresTest, AreTheSameBytesForAnyBricksAndThreads) {
    job_.resources.threads = 1;
    run_job();
    const std::string whole = archive_bytes(job_.output.path);
    job_.resources.threads = 2;
    job_.resources.brick_points = 200;
    run_job();
    EXPECT_EQ(archive_bytes(job_.output.path), whole);
}

TEST_F(MeasuresTest, ArePickedForRepairedAndCountedPointsToo) {
    job_.range.alpha = 0;
    job_.range.ratio = 0.2;
    job_.range.repair = 0.3;
    run_job();
    for (const auto& [place, measures] : carried()) {
        EXPECT_GT(measures.first, 0);
        EXPECT_GT(measures.second, 0);
    }
}

TEST_F(MeasuresTest, AnInputThatHasOneOfTheNamesIsRefused) {
    CloudHeader header;
    header.points = 1;
    header.attributes = {{"range", ScalarType::kFloat32}};
    PlyWriter writer(folder_ / "named.ply", header);
    const std::vector<Vec3> point{{1, 2, 3}};
    const float value = 1;
    writer.append(point, std::as_bytes(std::span(&value, 1)));
    writer.finish();
    job_.input.push_back((folder_ / "named.ply").string());
    EXPECT_THAT([&] { run_job(); }, ThrowsMessage<ConfigError>(HasSubstr(
                                        "expected inputs without an attribute range, found one")));
}

TEST_F(MeasuresTest, AreForKeptPointsOnly) {
    job_.output.path = (folder_ / "out.ply").string();
    job_.output.flag = true;
    EXPECT_THAT([&] { run_job(); }, ThrowsMessage<ConfigError>(HasSubstr("output.measures")));
}

TEST_F(MeasuresTest, APointThatNoRunHoldsIsAnError) {
    const SourceTable table({}, {});
    Selection selection(4);
    selection.set(2);
    selection.finish();
    EXPECT_THAT(
        [&] {
            Measures(
                table, selection, {}, [](double h) { return h; }, 1);
        },
        ThrowsMessage<StorageError>(HasSubstr("1 kept points in the ranked runs, found 0")));
}

}  // namespace
}  // namespace knap
