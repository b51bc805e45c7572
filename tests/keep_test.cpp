#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "knap/error.hpp"
#include "knap/job.hpp"
#include "output/ply_writer.hpp"
#include "support/clouds.hpp"
#include "support/resume_fixture.hpp"

namespace knap {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

class Silent final : public Progress {};

/// Points on a sphere, some of them twice and some not finite, with a class each.
struct Cloud {
    std::vector<Vec3> positions;
    std::vector<std::uint8_t> classes;

    Cloud(std::size_t points, std::uint64_t seed) {
        std::mt19937_64 random(seed);
        positions = test::sphere_cloud(points, seed);
        for (std::size_t i = 0; i < points; ++i) {
            if (random() % 20 == 0) {
                positions[i] = positions[random() % points];
            }
            if (random() % 100 == 0) {
                positions[i].y = std::numeric_limits<double>::quiet_NaN();
            }
            classes.push_back(static_cast<std::uint8_t>(random() % 10));
        }
    }

    void write(const std::filesystem::path& path, std::size_t begin, std::size_t end) const {
        CloudHeader header;
        header.points = end - begin;
        header.attributes = {{"class", ScalarType::kUint8}};
        PlyWriter writer(path, header);
        writer.append(std::span(positions).subspan(begin, end - begin),
                      std::as_bytes(std::span(classes).subspan(begin, end - begin)));
        writer.finish();
    }

    /// The ids that have to be there beside those that the ranges keep.
    std::set<PointId> held(const std::function<bool(std::uint8_t)>& condition) const {
        std::map<std::tuple<double, double, double>, PointId> first;
        std::set<PointId> ids;
        for (PointId id = 0; id < positions.size(); ++id) {
            const Vec3& p = positions[id];
            if (!is_finite(p)) {
                continue;
            }
            const PointId stands = first.try_emplace({p.x, p.y, p.z}, id).first->second;
            if (condition(classes[id])) {
                ids.insert(stands);
            }
        }
        return ids;
    }
};

class Keep : public testing::Test {
  protected:
    Keep() {
        cloud_.write(folder_ / "a.ply", 0, 3000);
        cloud_.write(folder_ / "b.ply", 3000, 6000);
        job_.input = {(folder_ / "a.ply").string(), (folder_ / "b.ply").string()};
        job_.range.alpha = 0.15;
        job_.output.path = (folder_ / "out.ply").string();
        job_.output.ids = (folder_ / "ids").string();
        job_.output.overwrite = true;
        job_.resources.memory_bytes = std::uint64_t{512} << 20;
    }

    Report run_job() {
        Silent silent;
        return run(job_, silent);
    }

    std::vector<PointId> ids() const { return test::read_ids(folder_ / "ids"); }

    test::TemporaryFolder folder_;
    Cloud cloud_{6000, 7};
    Job job_;
};

TEST_F(Keep, AddsJustThePointsThatAConditionHoldsForForAnyCut) {
    const Counts without = run_job().counts;
    const std::vector<PointId> kept = ids();
    std::set<PointId> expected = cloud_.held([](std::uint8_t c) { return c == 3 || c > 8; });
    expected.insert(kept.begin(), kept.end());
    job_.range.keep = "class == 3 || class > 8";
    for (const std::uint64_t brick_points : {100U, 700U, 100000U}) {
        for (const int threads : {1, 3}) {
            job_.resources.brick_points = brick_points;
            job_.resources.threads = threads;
            const Report report = run_job();
            EXPECT_THAT(ids(), testing::ElementsAreArray(expected));
            EXPECT_EQ(report.protected_points, expected.size() - kept.size());
            EXPECT_EQ(report.counts.kept, expected.size());
            EXPECT_EQ(report.counts.merged, without.merged);
            EXPECT_EQ(report.counts.kept + report.counts.represented,
                      without.kept + without.represented);
        }
    }
}

TEST_F(Keep, GoesWithAWantedNumberAndWithRepair) {
    job_.range.alpha = 0;
    job_.range.count = 500;
    job_.range.repair = 0.2;
    run_job();
    const std::vector<PointId> kept = ids();
    std::set<PointId> expected = cloud_.held([](std::uint8_t c) { return c == 0; });
    expected.insert(kept.begin(), kept.end());
    job_.range.keep = "class == 0";
    run_job();
    EXPECT_THAT(ids(), testing::ElementsAreArray(expected));
}

TEST_F(Keep, CoordinatesMayBeAskedFor) {
    job_.range.keep = "z > 0.9";
    run_job();
    const std::vector<PointId> found = ids();
    const std::set<PointId> kept(found.begin(), found.end());
    std::set<std::tuple<double, double, double>> seen;
    for (PointId id = 0; id < cloud_.positions.size(); ++id) {
        const Vec3& p = cloud_.positions[id];
        if (is_finite(p) && p.z > 0.9 && seen.insert({p.x, p.y, p.z}).second) {
            EXPECT_TRUE(kept.contains(id)) << id;
        }
    }
}

TEST_F(Keep, AnAttributeThatNoSourceHasIsAnErrorThatNamesThoseThatAreThere) {
    job_.range.keep = "klass == 0";
    EXPECT_THAT([&] { run_job(); }, ThrowsMessage<ConfigError>(
                                        HasSubstr("expected one of class, x, y, z, found klass")));
    job_.range.keep = "class[1] == 0";
    EXPECT_THAT([&] { run_job(); }, ThrowsMessage<ConfigError>(HasSubstr("below 1, found 1")));
}

TEST_F(Keep, FlagWritesAllFinitePointsAndWhichAreKept) {
    run_job();
    const std::vector<PointId> found = ids();
    const std::set<PointId> kept(found.begin(), found.end());
    job_.output.flag = true;
    const Report report = run_job();
    const auto source = open_source(job_.output.path);
    ASSERT_EQ(source->info().schema.back().name, "kept");
    source->select(std::vector<std::size_t>{3, 4});
    std::vector<PointId> finite;
    for (PointId id = 0; id < cloud_.positions.size(); ++id) {
        if (is_finite(cloud_.positions[id])) {
            finite.push_back(id);
        }
    }
    std::size_t next = 0;
    for (Chunk chunk; source->read(chunk, 1000);) {
        for (std::size_t i = 0; i < chunk.positions.size(); ++i, ++next) {
            ASSERT_LT(next, finite.size());
            const PointId id = finite[next];
            EXPECT_EQ(chunk.positions[i], cloud_.positions[id]);
            EXPECT_EQ(chunk.columns[0][i], std::byte{cloud_.classes[id]});
            EXPECT_EQ(chunk.columns[1][i], std::byte{kept.contains(id)});
        }
    }
    EXPECT_EQ(next, finite.size());
    EXPECT_EQ(report.counts.kept, kept.size());
    EXPECT_LT(finite.size(), cloud_.positions.size()) << "some are not finite";
}

TEST_F(Keep, FlagIsNotForDraco) {
    job_.output.flag = true;
    for (const char* name : {"archive", "one.drc"}) {
        job_.output.path = (folder_ / name).string();
        EXPECT_THAT([&] { run_job(); }, ThrowsMessage<ConfigError>(HasSubstr("output.flag")));
    }
}

class KeepResumed : public test::ResumeFixture {};

TEST_F(KeepResumed, AJobStoppedWhileItProtectsGoesOnToTheSameBytes) {
    job_.range.keep = "x > 0.5";
    const Report whole = run_whole();
    EXPECT_GT(whole.protected_points, 100U);
    const std::string expected = result();
    for (const char* stage : {"keep", "emit"}) {
        std::filesystem::remove_all(folder_ / "out");
        test::stop_in(job_, stage);
        const Report report = run_whole();
        EXPECT_TRUE(result() == expected) << stage;
        EXPECT_EQ(report.protected_points, whole.protected_points) << stage;
        EXPECT_EQ(report.counts, whole.counts) << stage;
    }
}

}  // namespace
}  // namespace knap
