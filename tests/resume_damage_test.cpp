#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "knap/error.hpp"
#include "knap/job.hpp"
#include "support/resume_fixture.hpp"

namespace knap {
namespace {

namespace fs = std::filesystem;
using test::kNever;
using test::sphere_cloud;
using test::stop_in;
using test::Stopper;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

class ResumeDamage : public test::ResumeFixture {};

TEST_F(ResumeDamage, ADamagedJournalIsToldAndLeftAlone) {
    stop_in(job_, "rank", 20);
    const fs::path journal = scratch() / "journal";
    std::string text = test::read_bytes(journal);
    text[text.size() / 2] ^= 1;
    test::write_bytes(journal, text);
    for (int attempt = 0; attempt < 2; ++attempt) {
        EXPECT_THAT([&] { run_whole(); },
                    ThrowsMessage<StorageError>(
                        AllOf(HasSubstr(journal.string()), HasSubstr("--restart"))));
    }
    job_.restart = true;
    EXPECT_EQ(run_whole().counts.in, 8000U);
}

TEST_F(ResumeDamage, ADamagedBrickIsMadeAgainFromTheSources) {
    run_whole();
    const std::string expected = result();
    stop_in(job_, "rank", 0);
    const std::vector<fs::path> bricks = scratch_files(".brick");
    ASSERT_GE(bricks.size(), 50U);
    std::string bytes = test::read_bytes(bricks[10]);
    bytes[bytes.size() / 2] ^= 4;
    test::write_bytes(bricks[10], bytes);
    test::write_bytes(bricks[20], test::read_bytes(bricks[20]).substr(0, 50));
    fs::remove(bricks[30]);
    Stopper never(kNever);
    run(job_, never);
    EXPECT_EQ(result() == expected, true);
    for (const std::size_t damaged : {10, 20, 30}) {
        EXPECT_THAT(never.notes(), testing::Contains(AllOf(HasSubstr(bricks[damaged].filename()),
                                                           HasSubstr("again"))));
    }
}

TEST_F(ResumeDamage, PositionsAreReadFromTheSourceAgain) {
    run_whole();
    const std::string expected = result();
    std::mt19937_64 random(7);
    for (const bool missing : {false, true}) {
        stop_in(job_, "scatter", 0);
        const std::vector<fs::path> files = scratch_files(".positions");
        ASSERT_EQ(files.size(), 1U) << "of the text";
        if (missing) {
            fs::remove(files[0]);
        } else {
            damage(random, files[0]);
        }
        Stopper never(kNever);
        run(job_, never);
        EXPECT_EQ(result() == expected, true);
        EXPECT_THAT(never.notes(), testing::Contains(AllOf(HasSubstr(files[0].string()),
                                                           HasSubstr("source again"))));
    }
}

TEST_F(ResumeDamage, AttributesInScratchAreReadFromTheSourceAgain) {
    std::string text = "x y z shade\n";
    for (const Vec3& p : sphere_cloud(3000, 5)) {
        text += fmt::format("{} {} {} {}\n", p.x, p.y, p.z, text.size() % 251);
    }
    test::write_bytes(folder_ / "more.xyz", text);
    job_.input.push_back((folder_ / "more.xyz").string());
    job_.range.keep = "shade < 10";
    run_whole();
    const std::string expected = result();
    std::mt19937_64 random(8);
    for (const char* stage : {"rank", "merge", "keep", "emit"}) {
        for (const char* ending : {".positions", ".columns"}) {
            for (const bool missing : {false, true}) {
                stop_in(job_, stage, 0);
                const std::vector<fs::path> files = scratch_files(ending);
                ASSERT_FALSE(files.empty()) << stage;
                const fs::path& file = files.back();
                if (missing) {
                    fs::remove(file);
                } else {
                    damage(random, file);
                }
                Stopper never(kNever);
                run(job_, never);
                EXPECT_EQ(result() == expected, true);
                EXPECT_THAT(never.notes(), testing::Contains(AllOf(HasSubstr(file.string()),
                                                                   HasSubstr("source again"))))
                    << stage;
            }
        }
    }
}

TEST_F(ResumeDamage, ABrickWhoseRunsAreDamagedIsRankedAgainFromTheSources) {
    run_whole();
    const std::string expected = result();
    std::mt19937_64 random(6);
    std::set<std::string> kinds;
    for (const int calls : {0, 20, 60, 100}) {
        for (const char* stage : {"rank", "merge", "emit"}) {
            job_.restart = true;
            stop_in(job_, stage,
                    stage == std::string("rank")   ? 2 * calls + 20
                    : stage == std::string("emit") ? 0
                                                   : calls);
            job_.restart = false;
            std::set<std::string> damaged;
            for (const char* kind : {".run", ".stragglers", ".kept", ".open"}) {
                const std::vector<fs::path> files = scratch_files(kind);
                for (std::size_t i = 0; i < std::min<std::size_t>(files.size(), 3); ++i) {
                    const fs::path& file = files[random() % files.size()];
                    if (damaged.insert(file.filename()).second) {
                        damage(random, file);
                        kinds.insert(kind);
                    }
                }
            }
            Stopper never(kNever);
            run(job_, never);
            EXPECT_EQ(result() == expected, true) << stage << " " << calls;
            EXPECT_FALSE(damaged.empty());
            EXPECT_THAT(never.notes(), testing::Contains(HasSubstr("from the sources again")));
            EXPECT_EQ(scratch(), fs::path());
        }
    }
    EXPECT_THAT(kinds, testing::UnorderedElementsAre(".run", ".stragglers", ".kept", ".open"));
}

TEST_F(ResumeDamage, AFlippedBitInAnyScratchFileIsNoticed) {
    run_whole();
    const std::string expected = result();
    std::mt19937_64 random(4);
    int noticed = 0;
    for (const char* stage : {"scatter", "rank", "merge", "emit"}) {
        for (int round = 0; round < 8; ++round) {
            job_.restart = true;
            stop_in(job_, stage,
                    stage == std::string("rank") || stage == std::string("merge")
                        ? static_cast<int>(random() % 50)
                        : 0);
            job_.restart = false;
            std::vector<fs::path> files;
            for (const auto& entry : fs::directory_iterator(scratch())) {
                if (entry.file_size() > 0) {
                    files.push_back(entry.path());
                }
            }
            std::sort(files.begin(), files.end());
            const fs::path file = files[random() % files.size()];
            damage(random, file);
            // Either nothing of the file mattered any more, or it is made again, or the error
            // names it.
            Stopper never(kNever);
            try {
                run(job_, never);
                EXPECT_EQ(result() == expected, true) << file;
                noticed += never.notes().size() > 1 ? 1 : 0;
            } catch (const StorageError& error) {
                EXPECT_THAT(error.what(), HasSubstr(file.filename().string()));
                ++noticed;
            }
        }
    }
    EXPECT_GT(noticed, 4);
}

TEST_F(ResumeDamage, ATornJournalLineIsAStepThatWasNotDone) {
    run_whole();
    const std::string expected = result();
    std::mt19937_64 random(3);
    for (int round = 0; round < 10; ++round) {
        stop_in(job_, "rank", static_cast<int>(random() % 60));
        const fs::path journal = scratch() / "journal";
        const std::string text = test::read_bytes(journal);
        const std::size_t last_line = text.rfind('\n', text.size() - 2) + 1;
        test::write_bytes(journal, text.substr(0, last_line + random() % 20));
        // What the lost line named may be gone: then the file it was made from is missing.
        try {
            run_whole();
            EXPECT_EQ(result() == expected, true);
        } catch (const StorageError& error) {
            EXPECT_THAT(error.what(), HasSubstr(".brick"));
            job_.restart = true;
            run_whole();
            job_.restart = false;
        }
    }
}

}  // namespace
}  // namespace knap
