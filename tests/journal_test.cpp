#include "store/journal.hpp"

#include <gtest/gtest.h>

#include <random>

#include "support/clouds.hpp"
#include "support/damage.hpp"

namespace knap {
namespace {

std::vector<JournalEntry> random_entries(std::mt19937_64& random, std::size_t count) {
    constexpr const char* kStages[] = {"survey", "plan", "scatter", "rank", "merge", "emit"};
    std::vector<JournalEntry> entries(count);
    for (JournalEntry& entry : entries) {
        entry.stage = kStages[random() % std::size(kStages)];
        entry.file = random() % 2 == 0 ? "" : std::to_string(random() % 1000) + ".brick";
        entry.details = R"({"points":)" + std::to_string(random()) + "}";
    }
    return entries;
}

void write(const std::filesystem::path& path, const std::vector<JournalEntry>& entries) {
    std::filesystem::remove(path);
    for (const JournalEntry& entry : entries) {
        append_to_journal(path, entry);
    }
}

bool is_prefix(const std::vector<JournalEntry>& part, const std::vector<JournalEntry>& whole) {
    return part.size() <= whole.size() && std::equal(part.begin(), part.end(), whole.begin());
}

class JournalFile : public testing::Test {
  protected:
    test::TemporaryFolder folder_;
    std::filesystem::path path_ = folder_ / "journal";
    std::mt19937_64 random_{5};
};

TEST_F(JournalFile, GivesBackTheEntriesInOrder) {
    for (const std::size_t count : {1U, 2U, 50U}) {
        const auto entries = random_entries(random_, count);
        write(path_, entries);
        EXPECT_EQ(read_journal(path_).entries, entries);
    }
}

TEST_F(JournalFile, WithoutAFileHasNoEntries) {
    const Journal journal = read_journal(path_);
    EXPECT_TRUE(journal.entries.empty());
    EXPECT_EQ(journal.whole_bytes, 0U);
    EXPECT_FALSE(journal.damaged);
}

TEST_F(JournalFile, ATornLastLineDoesNotCount) {
    const auto entries = random_entries(random_, 3);
    write(path_, entries);
    const std::string text = test::read_bytes(path_);
    test::with_each_cut(path_, [&](std::size_t size) {
        const auto whole =
            std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(size), '\n');
        const Journal read = read_journal(path_);
        EXPECT_EQ(std::ssize(read.entries), whole) << size << " bytes";
        EXPECT_TRUE(is_prefix(read.entries, entries));
        EXPECT_FALSE(read.damaged);
        EXPECT_EQ(read.whole_bytes, whole == 0 ? 0 : text.rfind('\n', size - 1) + 1);
    });
}

TEST_F(JournalFile, FromTheFirstDamagedLineOnNothingCounts) {
    const auto entries = random_entries(random_, 4);
    write(path_, entries);
    const std::string text = test::read_bytes(path_);
    test::with_each_bit_flipped(path_, [&](std::size_t at) {
        const Journal read = read_journal(path_);
        const auto before =
            std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
        EXPECT_EQ(std::ssize(read.entries), before) << "byte " << at;
        EXPECT_TRUE(is_prefix(read.entries, entries));
        EXPECT_EQ(read.whole_bytes, before == 0 ? 0 : text.rfind('\n', at - 1) + 1);
        // Without its newline the last line is torn, which is no damage.
        EXPECT_TRUE(read.damaged || at + 1 == text.size());
    });
}

TEST_F(JournalFile, ThatCannotBeReadOrWrittenIsAnErrorNamingIt) {
    EXPECT_TRUE(test::refuses(folder_.path(), [&] { read_journal(folder_.path()); }));
    const std::filesystem::path nowhere = folder_ / "none" / "journal";
    EXPECT_TRUE(test::refuses(nowhere, [&] { append_to_journal(nowhere, {"rank", "", "{}"}); }));
}

}  // namespace
}  // namespace knap
