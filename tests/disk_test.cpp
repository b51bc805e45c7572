#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "knap/error.hpp"
#include "knap/job.hpp"
#include "support/archive_bytes.hpp"
#include "support/clouds.hpp"

namespace knap {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

// A job whose scratch is a small disk of its own, which nothing outside this process sees.
class Disk : public testing::Test {
  protected:
    void SetUp() override {
        fs::create_directory(disk_);
        if (::unshare(CLONE_NEWNS) != 0 ||
            ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
            ::mount("tmpfs", disk_.c_str(), "tmpfs", 0, "size=4m") != 0) {
            GTEST_SKIP() << "needs the right to mount";
        }
        mounted_ = true;
        test::write_ply(folder_ / "in.ply", test::sphere_cloud(30000, 3), true);
        job_.input = {(folder_ / "in.ply").string()};
        job_.range.alpha = 0.05;
        job_.output.path = (folder_ / "out").string();
        job_.output.overwrite = true;
        job_.resources.threads = 2;
        job_.resources.brick_points = 3000;
        job_.resources.scratch = disk_.string();
    }

    void TearDown() override {
        if (mounted_) {
            ::umount2(disk_.c_str(), MNT_DETACH);
        }
    }

    test::TemporaryFolder folder_;
    fs::path disk_ = folder_ / "disk";
    bool mounted_ = false;
    Job job_;
};

// Fills the disk when a stage begins.
class Filler final : public Progress {
  public:
    Filler(std::string stage, fs::path file) : stage_(std::move(stage)), file_(std::move(file)) {}
    void begin(std::string_view stage, std::uint64_t /*total*/) override {
        if (stage == stage_) {
            std::ofstream file(file_, std::ios::binary);
            const std::string some(1 << 12, 'x');
            while (file << some << std::flush) {
            }
        }
    }

  private:
    std::string stage_;
    fs::path file_;
};

TEST_F(Disk, ThatFillsUpIsAnErrorAndTheJobGoesOnOnceThereIsRoom) {
    Progress silent;
    run(job_, silent);
    const std::string expected = test::archive_bytes(folder_ / "out");
    const fs::path filler = disk_ / "filler";
    for (const char* stage : {"scatter", "spacing", "rank", "merge"}) {
        Filler full(stage, filler);
        EXPECT_THAT(
            [&] { run(job_, full); },
            ThrowsMessage<StorageError>(AllOf(HasSubstr(disk_.string()), HasSubstr("No space left"),
                                              HasSubstr("the same command goes on"))))
            << stage;
        fs::remove(filler);
        run(job_, silent);
        EXPECT_EQ(test::archive_bytes(folder_ / "out") == expected, true) << stage;
        EXPECT_TRUE(fs::is_empty(disk_)) << "nothing is left behind";
    }
}

TEST_F(Disk, ThatIsTooSmallIsToldBeforeTheWork) {
    std::ofstream(disk_ / "other", std::ios::binary) << std::string(3800000, 'x');
    Progress silent;
    EXPECT_THAT([&] { run(job_, silent); },
                ThrowsMessage<StorageError>(AllOf(HasSubstr("the job needs about"),
                                                  HasSubstr("of scratch"), HasSubstr("are free"))));
    EXPECT_FALSE(fs::exists(folder_ / "out"));
}

TEST_F(Disk, ThatCannotBeWrittenIsAnErrorNamingIt) {
    ASSERT_EQ(::mount("tmpfs", disk_.c_str(), "tmpfs", MS_REMOUNT | MS_RDONLY, nullptr), 0);
    Progress silent;
    EXPECT_THAT([&] { run(job_, silent); }, ThrowsMessage<StorageError>(HasSubstr(disk_.string())));
    EXPECT_FALSE(fs::exists(folder_ / "out"));
}

}  // namespace
}  // namespace knap
