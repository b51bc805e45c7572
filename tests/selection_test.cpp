#include "store/selection.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "knap/error.hpp"
#include "support/clouds.hpp"

namespace knap {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

Selection random_selection(std::mt19937_64& random, std::uint64_t size,
                           std::vector<bool>& reference) {
    Selection selection(size);
    reference.assign(size, false);
    const std::uint64_t one_in = 1 + random() % 10;
    for (PointId id = 0; id < size; ++id) {
        if (random() % one_in == 0) {
            selection.set(id);
            reference[id] = true;
        }
    }
    selection.finish();
    return selection;
}

class SelectionFile : public testing::Test {
  protected:
    test::TemporaryFolder scratch_;
    std::filesystem::path path_ = scratch_.path() / "selection.bin";
};

TEST(Selection, AnswersAsAListOfFlagsDoes) {
    std::mt19937_64 random(1);
    for (const std::uint64_t size :
         {0U, 1U, 63U, 64U, 65U, 2047U, 2048U, 2049U, 4096U, 10000U, 65536U}) {
        std::vector<bool> reference;
        const Selection selection = random_selection(random, size, reference);
        std::uint64_t before = 0;
        for (PointId id = 0; id < size; ++id) {
            ASSERT_EQ(selection.test(id), reference[id]);
            ASSERT_EQ(selection.count_before(id), before);
            before += reference[id] ? 1 : 0;
        }
        EXPECT_EQ(selection.count_before(size), before);
        EXPECT_EQ(selection.count(), before);
        EXPECT_EQ(selection.size(), size);
    }
}

TEST_F(SelectionFile, ReadsBackWhatWasWritten) {
    std::mt19937_64 random(2);
    for (const std::uint64_t size : {0U, 1U, 64U, 2048U, 5000U}) {
        std::vector<bool> reference;
        const Selection selection = random_selection(random, size, reference);
        selection.save(path_);
        const Selection loaded = Selection::load(path_);
        EXPECT_EQ(loaded, selection);
        EXPECT_EQ(loaded.count(), selection.count());
        EXPECT_EQ(loaded.count_before(size), selection.count_before(size));
    }
}

TEST_F(SelectionFile, AFlippedBitAnywhereIsAnErrorNamingTheFile) {
    std::mt19937_64 random(3);
    std::vector<bool> reference;
    random_selection(random, 3000, reference).save(path_);
    const std::string good = read_text_file(path_);
    for (std::size_t i = 0; i < good.size(); ++i) {
        std::string bad = good;
        bad[i] = static_cast<char>(bad[i] ^ (1 << (random() % 8)));
        std::ofstream(path_, std::ios::binary) << bad;
        ASSERT_THAT([&] { Selection::load(path_); },
                    ThrowsMessage<StorageError>(HasSubstr(path_.string())))
            << "byte " << i;
    }
}

TEST_F(SelectionFile, AMissingShortOrLongFileIsAnErrorNamingIt) {
    EXPECT_THAT([&] { Selection::load(path_); },
                ThrowsMessage<StorageError>(HasSubstr(path_.string())));
    std::mt19937_64 random(4);
    std::vector<bool> reference;
    random_selection(random, 3000, reference).save(path_);
    const std::string good = read_text_file(path_);
    for (const std::string& bad : {good.substr(0, 0), good.substr(0, 39), good.substr(0, 40),
                                   good.substr(0, good.size() - 1), good + "x"}) {
        std::ofstream(path_, std::ios::binary) << bad;
        EXPECT_THAT([&] { Selection::load(path_); },
                    ThrowsMessage<StorageError>(HasSubstr(path_.string())))
            << bad.size();
    }
}

}  // namespace
}  // namespace knap
