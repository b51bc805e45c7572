#include "base/file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string>

#include "base/threads.hpp"
#include "knap/error.hpp"
#include "support/clouds.hpp"

namespace knap {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

std::ptrdiff_t entries_of(const fs::path& folder) {
    return std::distance(fs::directory_iterator(folder), {});
}

std::span<const std::byte> bytes_of(const std::string& text) {
    return std::as_bytes(std::span(text.data(), text.size()));
}

class File : public testing::Test {
  protected:
    test::TemporaryFolder folder_;
    fs::path path_ = folder_ / "file";
};

TEST_F(File, GivesBackAnyPartOfWhatWasWritten) {
    std::mt19937_64 random(1);
    std::string text;
    while (text.size() < 10000) {
        text += static_cast<char>(random());
    }
    write_text_file(path_, text);
    EXPECT_EQ(read_text_file(path_), text);
    const InputFile file(path_);
    EXPECT_EQ(file.size(), text.size());
    std::array<std::byte, 500> buffer;
    for (int round = 0; round < 1000; ++round) {
        const std::size_t at = random() % (text.size() + 300);
        const std::size_t wanted = random() % buffer.size();
        const std::string expected = at < text.size() ? text.substr(at, wanted) : "";
        const std::size_t got = file.read_some(at, std::span(buffer).first(wanted));
        ASSERT_EQ(std::string(reinterpret_cast<const char*>(buffer.data()), got), expected);
    }
}

TEST_F(File, OutlivesAMove) {
    write_text_file(path_, "text");
    InputFile first(path_);
    const InputFile second(std::move(first));
    std::array<std::byte, 4> buffer;
    EXPECT_EQ(second.read_some(0, buffer), 4U);
    EXPECT_EQ(second.path(), path_);
}

TEST_F(File, ThatIsMissingOrAFolderIsAnInputErrorNamingIt) {
    EXPECT_THAT(
        [&] { const InputFile file(path_); },
        ThrowsMessage<InputError>(AllOf(HasSubstr(path_.string()), HasSubstr("No such file"))));
    EXPECT_THAT([&] { const InputFile file(folder_.path()); },
                ThrowsMessage<InputError>(AllOf(HasSubstr(folder_.path().string()),
                                                HasSubstr("expected a regular file"))));
    EXPECT_THAT([&] { read_text_file(path_); },
                ThrowsMessage<InputError>(HasSubstr(path_.string())));
}

TEST_F(File, AtomicAppearsWholeOrNotAtAll) {
    for (const auto durability :
         {AtomicFile::Durability::kProcess, AtomicFile::Durability::kMachine}) {
        {
            AtomicFile file(path_, durability);
            file.write("one ");
            EXPECT_FALSE(fs::exists(path_));
            file.write("two");
            EXPECT_EQ(file.size(), 7U);
            file.commit();
        }
        EXPECT_EQ(read_text_file(path_), "one two");
        EXPECT_EQ(entries_of(folder_.path()), 1);
        fs::remove(path_);
    }
}

TEST_F(File, AtomicWithoutCommitLeavesWhatWasThere) {
    { AtomicFile(path_).write("lost"); }
    EXPECT_EQ(entries_of(folder_.path()), 0);
    write_text_file(path_, "old");
    { AtomicFile(path_).write("lost"); }
    EXPECT_EQ(read_text_file(path_), "old");
    EXPECT_EQ(entries_of(folder_.path()), 1);
}

TEST_F(File, AtomicReplacesWhatWasThere) {
    write_text_file(path_, "a longer text");
    write_text_file(path_, "short");
    EXPECT_EQ(read_text_file(path_), "short");
}

TEST_F(File, AtomicThatCannotBeCreatedOrRenamedIsAStorageErrorNamingItAndLeavesNothing) {
    const fs::path nowhere = folder_ / "none" / "file";
    EXPECT_THAT([&] { AtomicFile file(nowhere); },
                ThrowsMessage<StorageError>(
                    AllOf(HasSubstr(nowhere.string()), HasSubstr("cannot create"))));
    fs::create_directory(path_);
    EXPECT_THAT(
        [&] { write_text_file(path_, "text"); },
        ThrowsMessage<StorageError>(AllOf(HasSubstr(path_.string()), HasSubstr("cannot finish"))));
    EXPECT_EQ(entries_of(folder_.path()), 1) << "only the folder in the way";
}

TEST_F(File, AppendingGrowsManyFilesSideBySide) {
    std::array<std::string, 20> expected;
    for (int i = 0; i < 1000; ++i) {
        const std::size_t at = static_cast<std::size_t>(i * 7) % expected.size();
        const std::string text = "line " + std::to_string(i) + "\n";
        append_to_file(folder_ / std::to_string(at), bytes_of(text));
        expected[at] += text;
    }
    for (std::size_t at = 0; at < expected.size(); ++at) {
        EXPECT_EQ(read_text_file(folder_ / std::to_string(at)), expected[at]);
    }
}

TEST_F(File, AppendingWhereItCannotIsAStorageErrorNamingTheFile) {
    const fs::path nowhere = folder_ / "none" / "file";
    EXPECT_THAT([&] { append_to_file(nowhere, bytes_of("text")); },
                ThrowsMessage<StorageError>(HasSubstr(nowhere.string())));
}

TEST_F(File, AFullDiskIsAStorageErrorNamingTheFileAndTheReason) {
    const fs::path full = "/dev/full";
    if (!fs::exists(full)) {
        GTEST_SKIP() << "needs /dev/full";
    }
    EXPECT_THAT(
        [&] { append_to_file(full, bytes_of("text")); },
        ThrowsMessage<StorageError>(AllOf(HasSubstr(full.string()), HasSubstr("No space left"))));
}

TEST_F(File, ReadsFromManyThreadsAtOnce) {
    std::string text(1 << 16, '\0');
    for (std::size_t i = 0; i < text.size(); ++i) {
        text[i] = static_cast<char>(i >> 8);
    }
    write_text_file(path_, text);
    const InputFile file(path_);
    std::atomic<int> wrong{0};
    run_tasks(256, 4, [&](std::size_t i) {
        std::array<std::byte, 256> buffer;
        const std::size_t got = file.read_some(i * buffer.size(), buffer);
        const bool right = got == buffer.size() &&
                           std::all_of(buffer.begin(), buffer.end(),
                                       [&](std::byte b) { return b == static_cast<std::byte>(i); });
        wrong += right ? 0 : 1;
    });
    EXPECT_EQ(wrong, 0);
}

TEST(FormatBytes, PicksTheLargestUnitThatFits) {
    EXPECT_EQ(format_bytes(0), "0 B");
    EXPECT_EQ(format_bytes(1023), "1023 B");
    EXPECT_EQ(format_bytes(1024), "1.00 KiB");
    EXPECT_EQ(format_bytes(std::uint64_t{3} << 29), "1.50 GiB");
    EXPECT_EQ(format_bytes(std::uint64_t{5000} << 40), "5000.00 TiB");
}

}  // namespace
}  // namespace knap
