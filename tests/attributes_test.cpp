#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "emit/emit.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "knap/job.hpp"
#include "support/archive_bytes.hpp"
#include "support/attribute_cloud.hpp"
#include "support/clouds.hpp"
#include "support/resume_fixture.hpp"

namespace knap {
namespace {

using namespace test;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

namespace fs = std::filesystem;

/// A job of two files with attributes, some of which both have.
class Attributes : public testing::Test {
  protected:
    Attributes() {
        const AttributeCloud first = attribute_cloud(9000, 1);
        AttributeCloud second = attribute_cloud(6000, 2);
        std::mt19937_64 random(3);
        second.attributes = {{"any_char", ScalarType::kUint8},
                             {"red", ScalarType::kUint16},
                             {"any_double", ScalarType::kFloat64},
                             {"own", ScalarType::kInt32}};
        second.columns.clear();
        for (const Attribute& attribute : second.attributes) {
            second.columns.push_back(random_column(random, attribute, 6000, false));
        }
        write_ply(folder_ / "first.ply", first, true);
        write_ply(folder_ / "second.ply", second, false);
        job_.input = {(folder_ / "first.ply").string(), (folder_ / "second.ply").string()};
        job_.range.alpha = 0.02;
        job_.output.path = (folder_ / "archive").string();
        job_.output.ids = (folder_ / "ids").string();
        job_.output.tile_points = 1000;
        job_.output.overwrite = true;
        job_.resources.memory_bytes = std::uint64_t{512} << 20;
        job_.resources.threads = 2;
    }

    std::vector<std::string> run_job(const Job& job) {
        Stopper progress(kNever);
        run(job, progress);
        return progress.notes();
    }

    void expect_carried(const Job& job) {
        run_job(job);
        const Archive archive(job.output.path);
        archive.verify();
        const std::vector<fs::path> files(job.input.begin(), job.input.end());
        EXPECT_EQ(carried_by(archive),
                  carried_by_sources(files, read_ids(job.output.ids), archive.manifest()));
    }

    TemporaryFolder folder_;
    Job job_;
};

TEST_F(Attributes, OfSourcesOfDifferentSchemaAreKeptInEveryEncoding) {
    for (const TileEncoding encoding :
         {TileEncoding::kAuto, TileEncoding::kKdTree, TileEncoding::kSequential}) {
        job_.output.encoding = encoding;
        expect_carried(job_);
    }
    const Manifest manifest = Archive(job_.output.path).manifest();
    ASSERT_EQ(manifest.attributes.size(), 23U);
    EXPECT_EQ(manifest.attributes[0], (Attribute{"red", ScalarType::kUint16}));
    EXPECT_EQ(manifest.attributes[1], (Attribute{"green", ScalarType::kUint8}));
    EXPECT_EQ(manifest.attributes[6], (Attribute{"any_char", ScalarType::kInt16}));
    EXPECT_EQ(manifest.attributes[22], (Attribute{"own", ScalarType::kInt32}));
}

TEST_F(Attributes, ThatArePickedAreThoseCarried) {
    job_.output.attributes = {"own", "red"};
    expect_carried(job_);
    EXPECT_EQ(Archive(job_.output.path).manifest().attributes.size(), 2U);
    job_.output.attributes = {"none"};
    EXPECT_THAT(run_job(job_), Contains(AllOf(HasSubstr("stay behind"), HasSubstr("any_double"))));
    EXPECT_TRUE(Archive(job_.output.path).manifest().attributes.empty());
    job_.output.attributes = {"own", "rde"};
    EXPECT_THAT([&] { run_job(job_); }, ThrowsMessage<ConfigError>(HasSubstr("found \"rde\"")));
}

TEST_F(Attributes, ThatAreMissingSomewhereAreToldOnceWithTheirPoints) {
    const std::vector<std::string> notes = run_job(job_);
    EXPECT_EQ(std::count_if(notes.begin(), notes.end(),
                            [](const std::string& note) {
                                return note.find("\"own\" is 0 in 9000 input points") !=
                                       std::string::npos;
                            }),
              1);
    EXPECT_THAT(notes, Contains(HasSubstr("\"green\" is 0 in 6000 input points")));
}

TEST_F(Attributes, TheBytesDoNotDependOnBricksThreadsOrMemory) {
    run_job(job_);
    const auto expected = archive_bytes(job_.output.path);
    for (const std::uint64_t brick_points : {300U, 20000U}) {
        for (const int threads : {1, 3}) {
            Job other = job_;
            other.resources.brick_points = brick_points;
            other.resources.threads = threads;
            other.resources.memory_bytes = std::uint64_t{256} << 20;
            other.output.path = (folder_ / "other").string();
            run_job(other);
            EXPECT_EQ(archive_bytes(other.output.path), expected);
        }
    }
}

TEST_F(Attributes, AJobThatWasStoppedGivesTheSameBytes) {
    run_job(job_);
    const auto expected = archive_bytes(job_.output.path);
    Stopper counter(kNever);
    run(job_, counter);
    job_.output.path = (folder_ / "stopped").string();
    std::mt19937_64 random(4);
    int stopped = 0;
    for (int round = 0; round < 12; ++round) {
        // The last third of the calls is where kept points are read and tiles are written.
        const std::int64_t calls = counter.calls();
        Stopper stopper(calls - 1 - static_cast<std::int64_t>(random() % (calls / 3)));
        try {
            run(job_, stopper);
        } catch (const Interrupted&) {
            ++stopped;
            Stopper never(kNever);
            run(job_, never);
        }
        EXPECT_EQ(archive_bytes(job_.output.path), expected);
    }
    EXPECT_GT(stopped, 3);
}

TEST_F(Attributes, OfRealFilesAreThoseOfTheSource) {
    for (const char* name :
         {"lidar/extra_bytes_pf8.laz", "lidar/autzen_trim.las", "lidar/lone-star.copc.laz",
          "lidar/formats/extrabytes.las", "lidar/formats/pdrf8-1.4.laz"}) {
        const fs::path file = shared_file(name, folder_);
        if (file.empty()) {
            GTEST_SKIP() << "needs ../shared/data/lidar";
        }
        Job job = job_;
        job.input = {file.string()};
        job.range.alpha = 0;
        job.range.ratio = 0.2;
        job.output.tile_points = 20000;
        expect_carried(job);
        EXPECT_GT(Archive(job.output.path).manifest().attributes.size(), 10U) << name;
    }
}

}  // namespace
}  // namespace knap
