#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <string>

#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "knap/job.hpp"
#include "support/resume_fixture.hpp"

namespace knap {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::ThrowsMessage;

/// The report of a job, from end to end.
class ReportTest : public test::ResumeFixture {
  protected:
    ReportTest() { job_.output.report = true; }

    fs::path report_file() const { return folder_ / "out" / "report.html"; }

    /// The report without what a job cost; it is removed.
    std::string take_report() const {
        const std::string page = test::read_bytes(report_file());
        const std::size_t cost = page.find("<!-- knap: cost -->");
        EXPECT_NE(cost, std::string::npos);
        fs::remove(report_file());
        return page.substr(0, cost);
    }
};

TEST_F(ReportTest, ChangesNoByteOfTheArchive) {
    job_.output.report = false;
    run_whole();
    const std::string expected = result();
    job_.output.report = true;
    run_whole();
    EXPECT_NO_THROW(Archive(folder_ / "out").verify());
    take_report();
    EXPECT_EQ(result() == expected, true);
}

TEST_F(ReportTest, IsTheSameForAnyBricksAndThreads) {
    std::string expected;
    for (const auto& [brick_points, threads] : {std::pair{100, 1}, {1500, 3}, {100000, 2}}) {
        job_.resources.brick_points = static_cast<std::uint64_t>(brick_points);
        job_.resources.threads = threads;
        run_whole();
        const std::string found = take_report();
        EXPECT_TRUE(expected.empty() || found == expected) << brick_points << ", " << threads;
        expected = found;
    }
}

TEST_F(ReportTest, IsTheSameWhereAJobWasStopped) {
    run_whole();
    const std::string expected = take_report();
    for (const auto& [stage, calls] :
         {std::pair{"draw", 120}, {"merge", 40}, {"draw kept", 10}, {"emit", 3}}) {
        test::stop_in(job_, stage, calls);
        run_whole();
        EXPECT_EQ(take_report() == expected, true) << stage << " " << calls;
    }
}

TEST_F(ReportTest, IsTheSameWhereRunsAreDamaged) {
    run_whole();
    const std::string expected = take_report();
    std::mt19937_64 random(8);
    test::stop_in(job_, "draw", 1);
    for (const fs::path& run : {scratch_files(".run").front(), scratch_files(".run").back()}) {
        damage(random, run);
    }
    run_whole();
    EXPECT_EQ(take_report() == expected, true);
    test::stop_in(job_, "draw kept", 1);
    damage(random, scratch_files(".kept").front());
    run_whole();
    EXPECT_EQ(take_report() == expected, true);
}

TEST_F(ReportTest, IsMadeOfASearchedAlphaToo) {
    job_.range.alpha = 0;
    job_.range.count = 1000;
    run_whole();
    const std::string expected = take_report();
    EXPECT_THAT(expected, HasSubstr("<code>range.count</code></th><td class=\"path\">1000</td>"));
    test::stop_in(job_, "draw kept", 5);
    run_whole();
    EXPECT_EQ(take_report() == expected, true);
}

TEST_F(ReportTest, CannotBeAskedForWhenPointsAreGone) {
    job_.output.report = false;
    test::stop_in(job_, "emit", 1);
    job_.output.report = true;
    EXPECT_THAT([&] { run_whole(); },
                ThrowsMessage<ConfigError>(HasSubstr("it was begun without output.report")));
    job_.output.report = false;
    EXPECT_NO_THROW(run_whole()) << "the unfinished run is still there";
}

TEST_F(ReportTest, LiesBesideASingleFile) {
    for (const char* name : {"out.ply", "out.drc"}) {
        job_.output.path = (folder_ / name).string();
        job_.output.overwrite = false;
        job_.output.ids.clear();
        run_whole();
        const fs::path page = job_.output.path + ".report.html";
        EXPECT_THAT(test::read_bytes(page), HasSubstr("</html>"));
        fs::remove(job_.output.path);
        EXPECT_THAT([&] { run_whole(); },
                    ThrowsMessage<ConfigError>(HasSubstr("output.report (--report)")));
    }
}

TEST_F(ReportTest, OfNoPointsOrOneIsAPageToo) {
    for (const std::vector<Vec3>& cloud : {std::vector<Vec3>{}, std::vector<Vec3>{{1, 2, 3}},
                                           std::vector<Vec3>(10, Vec3{1, 2, 3})}) {
        test::write_ply(folder_ / "in.ply", cloud);
        job_.input = {(folder_ / "in.ply").string()};
        run_whole();
        EXPECT_THAT(take_report(), HasSubstr("id=\"counts\""));
    }
}

}  // namespace
}  // namespace knap
