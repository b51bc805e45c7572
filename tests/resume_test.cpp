#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <random>
#include <set>
#include <thread>

#include "base/scratch.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "knap/job.hpp"
#include "support/resume_fixture.hpp"

namespace knap {
namespace {

class Resume : public test::ResumeFixture {};
using test::kNever;
using test::stop_in;
using test::Stopper;

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST_F(Resume, AJobStoppedAnywhereGoesOnToTheSameBytes) {
    const Report whole = run_whole();
    ASSERT_GE(whole.bricks, 60U);
    const std::string expected = result();
    Stopper counter(kNever);
    run(job_, counter);
    std::mt19937_64 random(1);
    int went_on = 0;
    for (int round = 0; round < 25; ++round) {
        fs::remove_all(folder_ / "out");
        // Up to four stops in one job.
        for (int stop = 0; stop < 4; ++stop) {
            Stopper stopper(
                static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(counter.calls())));
            try {
                run(job_, stopper);
                break;
            } catch (const Interrupted& error) {
                went_on += stop > 0 && !stopper.notes().empty() ? 1 : 0;
            }
        }
        const Report report = run_whole();
        ASSERT_EQ(result() == expected, true) << "round " << round;
        ASSERT_EQ(report.counts, whole.counts);
        ASSERT_EQ(report.mean_curvature, whole.mean_curvature);
        ASSERT_EQ(report.stragglers, whole.stragglers);
        ASSERT_EQ(scratch(), fs::path()) << "nothing is left after success";
    }
    EXPECT_GT(went_on, 5);
}

// One run of the program itself, killed without warning after a while.
bool run_and_kill(const std::vector<std::string>& arguments, std::chrono::microseconds after) {
    const pid_t child = ::fork();
    if (child == 0) {
        ::close(STDOUT_FILENO);
        ::open("/dev/null", O_WRONLY);
        std::vector<char*> argv;
        for (const std::string& argument : arguments) {
            argv.push_back(const_cast<char*>(argument.c_str()));
        }
        argv.push_back(nullptr);
        ::execv(argv[0], argv.data());
        ::_exit(127);
    }
    std::this_thread::sleep_for(after);
    ::kill(child, SIGKILL);
    int status = 0;
    ::waitpid(child, &status, 0);
    if (WIFEXITED(status)) {
        EXPECT_EQ(WEXITSTATUS(status), 0);
        return false;
    }
    return true;
}

TEST_F(Resume, AProcessKilledAtAnyMomentGoesOnToTheSameBytes) {
    const auto started = std::chrono::steady_clock::now();
    run_whole();
    const auto elapsed = std::chrono::duration_cast<std::chrono::microseconds>(
        std::chrono::steady_clock::now() - started);
    const std::string expected = result();
    const std::vector<std::string> command{KNAP_PROGRAM,
                                           "simplify",
                                           job_.input[0],
                                           job_.input[1],
                                           "-o",
                                           job_.output.path,
                                           "--ids",
                                           job_.output.ids,
                                           "--alpha",
                                           "0.05",
                                           "--tile-points",
                                           "1000",
                                           "--brick-points",
                                           "100",
                                           "--overwrite",
                                           "--quiet",
                                           "--threads",
                                           "2",
                                           "--memory",
                                           "512MiB"};
    std::mt19937_64 random(2);
    const char* asked = std::getenv("KNAP_KILLS");
    const int kills = asked == nullptr ? 10 : std::atoi(asked);
    auto latest = 2 * elapsed;
    int killed = 0;
    for (int run = 0; killed < kills && run < 20 * kills; ++run) {
        fs::remove_all(folder_ / "out");
        const auto moment =
            std::chrono::microseconds(random() % static_cast<std::uint64_t>(latest.count() + 1));
        if (run_and_kill(command, moment)) {
            ++killed;
        } else {
            // It ended before: on a busy machine the first run may have been a slow one.
            latest = std::max(moment, elapsed / 20);
        }
        run_whole();
        ASSERT_EQ(result() == expected, true) << "killed after " << moment.count() << " us";
    }
    EXPECT_EQ(killed, kills) << "the moments lie within the run";
}

TEST_F(Resume, ASearchForAlphaGoesOnToTheSameBytes) {
    // Smooth here and rough there, so that a sample foretells the count badly.
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<Vec3> cloud(250000);
    for (Vec3& p : cloud) {
        p.x = unit(random);
        p.y = unit(random);
        p.z = p.x > 0.4 && p.y > 0.3 ? 0.02 * std::sin(70 * p.x) * std::cos(60 * p.y) : 0;
    }
    test::write_ply(folder_ / "in.ply", cloud, true);
    job_.input = {(folder_ / "in.ply").string()};
    job_.range.alpha = 0;
    job_.range.count = 30000;
    job_.resources.brick_points = 20000;
    Stopper counted(kNever);
    const Report whole = run(job_, counted);
    EXPECT_NEAR(static_cast<double>(whole.counts.kept), 30000, 300);
    const std::string expected = result();
    int attempts = 0;
    for (int calls : {10, 30, 50}) {
        stop_in(job_, "merge", calls);
        const std::string journal = test::read_bytes(scratch() / "journal");
        attempts += journal.find(" attempt\t") != std::string::npos ? 1 : 0;
        run_whole();
        EXPECT_EQ(result() == expected, true) << "stopped at call " << calls;
    }
    EXPECT_GT(attempts, 0) << "some were stopped after a first attempt";
}

TEST_F(Resume, AToleranceOnAFlatCloudGoesOnAfterMerge) {
    std::vector<Vec3> cloud;
    for (int i = 0; i < 5000; ++i) {
        cloud.push_back({0.1 * (i % 70), 0.1 * (i / 70), 0});
    }
    test::write_ply(folder_ / "in.ply", cloud, true);
    job_.input = {(folder_ / "in.ply").string()};
    job_.curvature.estimator = Estimator::kQuadric;
    job_.range = {.law = RangeLawKind::kChord, .tolerance = 0.01};
    run_whole();
    const std::string expected = result();
    stop_in(job_, "emit", 0);
    run_whole();
    EXPECT_EQ(result() == expected, true);
    EXPECT_THAT(Archive(folder_ / "out").manifest().parameters,
                testing::Contains(testing::Pair("range.law", "chord")));
}

TEST_F(Resume, WhatASurveyLeftThatWasStoppedIsRemoved) {
    run_whole();
    const std::string expected = result();
    stop_in(job_, "rank", 1);
    // As if the process had died inside its survey.
    const std::string journal = test::read_bytes(scratch() / "journal");
    test::write_bytes(scratch() / "journal", journal.substr(0, journal.find('\n') + 1));
    for (const char* name :
         {"000009-000000000000.positions", "000001-000000000000.positions.partial"}) {
        test::write_bytes(scratch() / name, "what is left");
    }
    stop_in(job_, "rank", 1);
    EXPECT_FALSE(fs::exists(scratch() / "000009-000000000000.positions"));
    EXPECT_FALSE(fs::exists(scratch() / "000001-000000000000.positions.partial"));
    run_whole();
    EXPECT_EQ(result() == expected, true);
}

TEST_F(Resume, DoesNotDoAgainWhatIsDone) {
    stop_in(job_, "rank", 60);
    const fs::path journal = scratch() / "journal";
    const std::string before = test::read_bytes(journal);
    const auto ranked = [](const std::string& text) {
        std::size_t count = 0;
        for (std::size_t at = text.find(" rank\t"); at != std::string::npos;
             at = text.find(" rank\t", at + 1)) {
            ++count;
        }
        return count;
    };
    EXPECT_GE(ranked(before), 28U);
    stop_in(job_, "merge", 10);
    const std::string after = test::read_bytes(journal);
    EXPECT_EQ(after.substr(0, before.size()), before) << "what is recorded stays";
    EXPECT_EQ(ranked(after), run_whole().bricks) << "each brick was ranked once";
}

TEST_F(Resume, RefusesAnotherJobAndTellsWhatIsDifferent) {
    stop_in(job_, "rank", 5);
    const auto expect_refusal = [&](const Job& job, const std::string& what) {
        Stopper never(kNever);
        EXPECT_THAT([&] { run(job, never); },
                    ThrowsMessage<ConfigError>(AllOf(HasSubstr(what), HasSubstr("--restart"))));
        EXPECT_NE(scratch(), fs::path()) << "and leaves what is there alone";
    };
    Job other = job_;
    other.range.alpha = 0.06;
    expect_refusal(other, "range.alpha was 0.05, is 0.06");
    other = job_;
    other.output.tile_points = 1001;
    expect_refusal(other, "output.tile_points was 1000, is 1001");

    const std::string bytes = test::read_bytes(folder_ / "in.ply");
    test::write_bytes(folder_ / "in.ply", bytes + "x");
    expect_refusal(job_, "in.ply had");
    std::string changed = bytes;
    changed[changed.size() - 3] ^= 1;
    test::write_bytes(folder_ / "in.ply", changed);
    expect_refusal(job_, "holds something else");

    // The same bytes with another time are the same input.
    test::write_bytes(folder_ / "in.ply", bytes);
    EXPECT_EQ(run_whole().counts.in, 8000U);
}

TEST_F(Resume, GoesOnWithOtherResources) {
    run_whole();
    const std::string expected = result();
    for (const char* stage : {"scatter", "rank", "merge", "emit"}) {
        stop_in(job_, stage, 0);
        Job other = job_;
        other.resources.threads = 1;
        other.resources.memory_bytes = std::uint64_t{1} << 30;
        other.resources.brick_points = 5000;
        Stopper never(kNever);
        run(other, never);
        EXPECT_EQ(result() == expected, true) << stage;
    }
}

TEST_F(Resume, RestartThrowsAwayWhatIsThere) {
    stop_in(job_, "rank", 5);
    job_.restart = true;
    job_.range.alpha = 0.06;
    Stopper never(kNever);
    run(job_, never);
    EXPECT_EQ(scratch(), fs::path());
    EXPECT_TRUE(never.notes().empty()) << "nothing to go on with";
}

TEST_F(Resume, OfTwoRunsTheSecondIsRefused) {
    stop_in(job_, "rank", 5);
    const ScratchFolder other(scratch());
    EXPECT_THAT([&] { run_whole(); },
                ThrowsMessage<StorageError>(HasSubstr("another run of knap works")));
}

TEST_F(Resume, TilesThatAreDoneAreNotEncodedAgain) {
    job_.range.alpha = 0.005;
    run_whole();
    const std::string expected = result();
    job_.resources.threads = 1;
    const fs::path partial = folder_ / "out.partial";
    std::vector<fs::path> tiles;
    for (int calls = 1; tiles.empty(); ++calls) {
        stop_in(job_, "emit", calls);
        for (const auto& entry : fs::directory_iterator(partial / "tiles")) {
            tiles.push_back(entry.path());
        }
    }
    std::sort(tiles.begin(), tiles.end());
    const auto written = fs::last_write_time(tiles.front());
    EXPECT_EQ(run_whole().counts.in, 8000U);
    EXPECT_EQ(result() == expected, true);
    EXPECT_EQ(fs::last_write_time(folder_ / "out" / "tiles" / tiles.front().filename()), written);
    EXPECT_FALSE(fs::exists(partial));

    stop_in(job_, "emit", 1);
    EXPECT_TRUE(fs::exists(scratch()));
    job_.range.alpha *= 2;
    job_.restart = true;
    run_whole();
    EXPECT_FALSE(fs::exists(partial)) << "what is begun anew takes nothing up";
    EXPECT_EQ(Archive(folder_ / "out").verify().tiles,
              Archive(folder_ / "out").manifest().tiles.size());
}

}  // namespace
}  // namespace knap
