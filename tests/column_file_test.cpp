#include "store/column_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "support/clouds.hpp"
#include "support/damage.hpp"

namespace knap {
namespace {

using Columns = std::vector<std::vector<std::byte>>;

class ColumnFileTest : public testing::Test {
  protected:
    Columns random_columns(std::size_t points) {
        Columns columns;
        columns.reserve(sizes_.size());
        for (const std::size_t size : sizes_) {
            std::vector<std::byte>& column = columns.emplace_back(points * size);
            // Some columns are the same throughout, some noise.
            const unsigned mask = random_() % 2 == 0 ? 0 : 255;
            for (std::byte& value : column) {
                value = static_cast<std::byte>(random_() & mask);
            }
        }
        return columns;
    }

    void write(const Columns& columns, std::size_t points) {
        std::filesystem::remove(path_);
        ColumnWriter writer(path_, sizes_);
        for (std::size_t at = 0; at < points;) {
            const std::size_t count = std::min<std::size_t>(points - at, 1 + random_() % 500);
            writer.add(columns, at, count);
            at += count;
        }
        EXPECT_FALSE(std::filesystem::exists(path_)) << "exists before it is finished";
        const std::uint64_t bytes = writer.finish();
        EXPECT_EQ(std::filesystem::file_size(path_), bytes);
    }

    Columns read(const std::vector<std::size_t>& wanted) const {
        ColumnReader reader(path_, sizes_);
        Columns all(wanted.size());
        for (Columns block; const std::size_t count = reader.next(wanted, block);) {
            EXPECT_EQ(block.size(), wanted.size());
            for (std::size_t i = 0; i < wanted.size(); ++i) {
                EXPECT_EQ(block[i].size(), count * sizes_[wanted[i]]);
                all[i].insert(all[i].end(), block[i].begin(), block[i].end());
            }
        }
        return all;
    }

    test::TemporaryFolder folder_;
    std::filesystem::path path_ = folder_ / "0.columns";
    std::mt19937_64 random_{3};
    std::vector<std::size_t> sizes_{1, 2, 8, 24, 300};
};

TEST_F(ColumnFileTest, GivesBackTheColumnsThatAreAskedFor) {
    for (int round = 0; round < 50; ++round) {
        const std::size_t points = random_() % 3000;
        const Columns columns = random_columns(points);
        write(columns, points);
        ASSERT_EQ(read({0, 1, 2, 3, 4}), columns);
        ASSERT_EQ(read({3, 1}), (Columns{columns[3], columns[1]}));
        ASSERT_TRUE(read({}).empty());
    }
}

TEST_F(ColumnFileTest, WhatDoesNotChangeTakesNearlyNoRoom) {
    sizes_ = {8};
    write({std::vector<std::byte>(8 * 16384, std::byte{7})}, 16384);
    EXPECT_LT(std::filesystem::file_size(path_), 16384U);
}

TEST_F(ColumnFileTest, DamagedIsAnErrorNamingIt) {
    sizes_ = {2, 3};
    write(random_columns(40), 40);
    const auto reads = [&] { read({0, 1}); };
    test::with_each_bit_flipped(
        path_, [&](std::size_t at) { EXPECT_TRUE(test::refuses(path_, reads)) << "byte " << at; });
    test::with_each_cut(path_, [&](std::size_t size) {
        EXPECT_TRUE(test::refuses(path_, reads)) << size << " bytes";
    });
    sizes_ = {3, 2};
    EXPECT_TRUE(test::refuses(path_, reads)) << "of other columns";
    std::filesystem::remove(path_);
    EXPECT_TRUE(test::refuses(path_, reads)) << "missing";
}

}  // namespace
}  // namespace knap
