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

class Journal : public testing::Test {
  protected:
    test::TemporaryFolder folder_;
    std::filesystem::path path_ = folder_ / "journal";
    std::mt19937_64 random_{5};
};

TEST_F(Journal, GivesBackTheEntriesInOrder) {
    for (const std::size_t count : {1U, 2U, 50U}) {
        const auto entries = random_entries(random_, count);
        write(path_, entries);
        EXPECT_EQ(read_journal(path_), entries);
    }
}

TEST_F(Journal, WithoutAFileHasNoEntries) {
    EXPECT_TRUE(read_journal(path_).empty());
}

TEST_F(Journal, ATornLastLineDoesNotCount) {
    const auto entries = random_entries(random_, 3);
    write(path_, entries);
    const std::string text = test::read_bytes(path_);
    test::with_each_cut(path_, [&](std::size_t size) {
        const auto whole =
            std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(size), '\n');
        const std::vector<JournalEntry> read = read_journal(path_);
        EXPECT_EQ(std::ssize(read), whole) << size << " bytes";
        EXPECT_TRUE(is_prefix(read, entries));
    });
}

TEST_F(Journal, ABitFlippedBeforeTheLastLineIsAnErrorNamingTheFile) {
    const auto entries = random_entries(random_, 3);
    write(path_, entries);
    const std::string text = test::read_bytes(path_);
    const std::size_t last_line = text.rfind('\n', text.size() - 2) + 1;
    test::with_each_bit_flipped(path_, [&](std::size_t at) {
        std::vector<JournalEntry> read;
        if (!test::refuses(path_, [&] { read = read_journal(path_); })) {
            // Its newline damaged, the line before the last is part of the last.
            EXPECT_GE(at + 1, last_line);
            EXPECT_LT(read.size(), entries.size());
            EXPECT_TRUE(is_prefix(read, entries)) << "what is damaged never counts";
        }
    });
}

TEST_F(Journal, ADamagedLastLineDoesNotCountEither) {
    auto entries = random_entries(random_, 3);
    write(path_, entries);
    std::string text = test::read_bytes(path_);
    text[text.size() - 3] ^= 1;
    test::write_bytes(path_, text);
    entries.pop_back();
    EXPECT_EQ(read_journal(path_), entries);
}

TEST_F(Journal, TheErrorSaysWhichLine) {
    write(path_, random_entries(random_, 5));
    std::string text = test::read_bytes(path_);
    const std::size_t third_line = text.find('\n', text.find('\n') + 1) + 1;
    text[third_line + 20] ^= 1;
    test::write_bytes(path_, text);
    try {
        read_journal(path_);
        FAIL() << "expected a StorageError";
    } catch (const StorageError& error) {
        EXPECT_NE(std::string(error.what()).find("line 3"), std::string::npos) << error.what();
    }
}

TEST_F(Journal, ThatCannotBeReadOrWrittenIsAnErrorNamingIt) {
    EXPECT_TRUE(test::refuses(folder_.path(), [&] { read_journal(folder_.path()); }));
    const std::filesystem::path nowhere = folder_ / "none" / "journal";
    EXPECT_TRUE(test::refuses(nowhere, [&] { append_to_journal(nowhere, {"rank", "", "{}"}); }));
}

}  // namespace
}  // namespace knap
