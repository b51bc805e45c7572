#include "base/scratch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "base/file.hpp"
#include "base/threads.hpp"
#include "knap/error.hpp"
#include "support/clouds.hpp"

namespace knap {
namespace {

namespace fs = std::filesystem;

TEST(Scratch, IsRemovedWithAllInItUnlessItIsKept) {
    const test::TemporaryFolder parent;
    const fs::path path = parent / "job";
    {
        ScratchFolder scratch(path);
        EXPECT_EQ(scratch.path(), path);
        fs::create_directories(scratch.path() / "a" / "b");
        write_text_file(scratch.path() / "a" / "b" / "file", "text");
    }
    EXPECT_TRUE(fs::is_empty(parent.path()));
    {
        ScratchFolder scratch(path);
        write_text_file(scratch.path() / "file", "text");
        scratch.keep(true);
    }
    EXPECT_EQ(read_text_file(path / "file"), "text");
    {
        ScratchFolder scratch(path);
        EXPECT_EQ(scratch.used_bytes(), 4U) << "what is there counts";
        EXPECT_EQ(read_text_file(path / "file"), "text");
        scratch.clear();
        EXPECT_FALSE(fs::exists(path / "file"));
        EXPECT_EQ(scratch.used_bytes(), 0U);
    }
    EXPECT_TRUE(fs::is_empty(parent.path()));
}

TEST(Scratch, OfTwoJobsInOneFolderTheSecondIsRefused) {
    const test::TemporaryFolder parent;
    const fs::path path = parent / "job";
    {
        const ScratchFolder first(path);
        write_text_file(path / "file", "first");
        EXPECT_THAT(
            [&] { const ScratchFolder second(path); },
            testing::ThrowsMessage<StorageError>(testing::AllOf(
                testing::HasSubstr(path.string()), testing::HasSubstr("another run of knap"))));
        EXPECT_EQ(read_text_file(path / "file"), "first") << "the first keeps its files";
    }
    EXPECT_NO_THROW({ const ScratchFolder third(path); });
}

TEST(Scratch, MakesItsParents) {
    const test::TemporaryFolder parent;
    const ScratchFolder scratch(parent / "a" / "b");
    EXPECT_TRUE(fs::is_directory(scratch.path()));
}

TEST(Scratch, WhereNoFolderCanBeIsAStorageErrorNamingIt) {
    const test::TemporaryFolder parent;
    write_text_file(parent / "file", "in the way");
    for (const fs::path& path : {parent / "file", parent / "file" / "below"}) {
        EXPECT_THAT([&] { const ScratchFolder scratch(path); },
                    testing::ThrowsMessage<StorageError>(testing::HasSubstr(path.string())));
    }
}

TEST(Scratch, RemembersThePeakFromAnyThread) {
    const test::TemporaryFolder parent;
    ScratchFolder scratch(parent / "job");
    EXPECT_EQ(scratch.peak_bytes(), 0U);
    scratch.grew_by(100);
    scratch.grew_by(-60);
    scratch.grew_by(50);
    EXPECT_EQ(scratch.peak_bytes(), 100U);
    EXPECT_EQ(scratch.used_bytes(), 90U);
    scratch.grew_by(-90);
    run_tasks(1000, 4, [&](std::size_t) { scratch.grew_by(3); });
    EXPECT_EQ(scratch.peak_bytes(), 3000U) << "nothing is lost between threads";
}

TEST(FreeBytes, OfAFolderThatIsNotThereAreThoseOfItsParent) {
    const test::TemporaryFolder parent;
    EXPECT_GT(free_bytes(parent.path()), 0U);
    EXPECT_GT(free_bytes(parent / "a" / "b" / "c"), 0U);
    EXPECT_GT(free_bytes("relative/and/absent"), 0U);
}

TEST(ResidentBytes, SeeWhatIsTouched) {
    constexpr std::size_t kBytes = std::size_t{64} << 20;
    const std::uint64_t before = resident_bytes();
    std::vector<char> memory(kBytes);
    std::memset(memory.data(), 1, memory.size());
    EXPECT_GE(resident_bytes(), before + kBytes / 2) << memory[kBytes / 2];
    EXPECT_GE(peak_resident_bytes(), resident_bytes() / 2);
}

}  // namespace
}  // namespace knap
