#include "store/brick_file.hpp"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "support/brick_points.hpp"
#include "support/clouds.hpp"
#include "support/damage.hpp"
#include "support/random_table.hpp"

namespace knap {
namespace {

struct Stored {
    BrickPoints all;               ///< core, then halo, in the order of the file
    std::set<std::size_t> ends{};  ///< sizes of the file between blocks
};

// Blocks of core and halo points of any source in any order.
Stored write_random(const std::filesystem::path& path, const SourceTable& table,
                    std::mt19937_64& random, std::size_t blocks, std::size_t most_in_block) {
    create_brick_file(path, table);
    BrickPoints core;
    BrickPoints halo;
    Stored stored;
    std::size_t size = std::filesystem::file_size(path);
    stored.ends.insert(size);
    BrickBlock block;
    for (std::size_t b = 0; b < blocks; ++b) {
        block.clear();
        block.part = random() % 2 == 0 ? BrickPart::kCore : BrickPart::kHalo;
        block.source = static_cast<std::uint32_t>(random() % table.sources().size());
        BrickPoints& part = block.part == BrickPart::kCore ? core : halo;
        PointId id = random() >> (random() % 64);
        for (std::size_t i = 1 + random() % most_in_block; i > 0; --i) {
            part.positions.push_back(test::random_position(random, table, block.source));
            part.ids.push_back(id);
            block.add(table, id, part.positions.back());
            id += 1 + (random() >> (random() % 44 + 20));
        }
        const std::uint64_t bytes = append_block(path, block);
        size += bytes;
        EXPECT_EQ(std::filesystem::file_size(path), size);
        stored.ends.insert(size);
    }
    stored.all = core;
    stored.all.core_count = core.ids.size();
    stored.all.positions.insert(stored.all.positions.end(), halo.positions.begin(),
                                halo.positions.end());
    stored.all.ids.insert(stored.all.ids.end(), halo.ids.begin(), halo.ids.end());
    return stored;
}

bool same(const BrickPoints& a, const BrickPoints& b) {
    return a.positions == b.positions && a.ids == b.ids && a.core_count == b.core_count;
}

BrickPoints core_of(BrickPoints brick) {
    brick.positions.resize(brick.core_count);
    brick.ids.resize(brick.core_count);
    return brick;
}

class BrickFileTest : public testing::Test {
  protected:
    test::TemporaryFolder folder_;
    std::filesystem::path path_ = folder_ / "000000.brick";
    std::mt19937_64 random_{7};
};

TEST_F(BrickFileTest, GivesBackWhatWasWrittenForNarrowAndWideTables) {
    for (int round = 0; round < 200; ++round) {
        const SourceTable table = test::random_table(random_, round % 2 == 0);
        const Stored stored = write_random(path_, table, random_, random_() % 8, 40);
        ASSERT_TRUE(same(test::read_brick_file(path_, table), stored.all)) << "round " << round;
        ASSERT_TRUE(same(test::read_brick_file(path_, table, false), core_of(stored.all)));
        std::filesystem::remove(path_);
    }
}

TEST_F(BrickFileTest, ABitFlippedAnywhereIsAnErrorNamingTheFile) {
    for (const bool wide : {false, true}) {
        const SourceTable table = test::random_table(random_, wide);
        write_random(path_, table, random_, 5, 3);
        test::with_each_bit_flipped(path_, [&](std::size_t at) {
            EXPECT_TRUE(test::refuses(path_, [&] { test::read_brick_file(path_, table); }))
                << "byte " << at;
        });
        std::filesystem::remove(path_);
    }
}

TEST_F(BrickFileTest, ABitFlippedInTheHaloDoesNotChangeTheCore) {
    const SourceTable table = test::random_table(random_, false);
    const BrickPoints core = core_of(write_random(path_, table, random_, 5, 3).all);
    test::with_each_bit_flipped(path_, [&](std::size_t at) {
        BrickPoints read;
        if (!test::refuses(path_, [&] { read = test::read_brick_file(path_, table, false); })) {
            EXPECT_TRUE(same(read, core)) << "byte " << at;
        }
    });
}

TEST_F(BrickFileTest, ACutInsideABlockIsAnErrorAndOneBetweenBlocksShowsInTheCounts) {
    const SourceTable table = test::random_table(random_, false);
    const Stored stored = write_random(path_, table, random_, 5, 3);
    test::with_each_cut(path_, [&](std::size_t size) {
        BrickPoints read;
        const bool refused =
            test::refuses(path_, [&] { read = test::read_brick_file(path_, table); });
        EXPECT_EQ(refused, !stored.ends.contains(size)) << size << " bytes";
        EXPECT_LT(read.ids.size(), stored.all.ids.size());
    });
}

TEST_F(BrickFileTest, OfAnotherTableIsAnError) {
    const SourceTable narrow = test::random_table(random_, false);
    const SourceTable wide = test::random_table(random_, true);
    write_random(path_, narrow, random_, 3, 3);
    EXPECT_TRUE(test::refuses(path_, [&] { test::read_brick_file(path_, wide); }));
}

TEST_F(BrickFileTest, MissingIsAnErrorNamingIt) {
    const SourceTable table = test::random_table(random_, false);
    EXPECT_TRUE(test::refuses(path_, [&] { test::read_brick_file(path_, table); }));
}

TEST_F(BrickFileTest, ThatCannotBeWrittenIsAnErrorNamingIt) {
    const SourceTable table = test::random_table(random_, false);
    const std::filesystem::path nowhere = folder_ / "none" / "000000.brick";
    EXPECT_TRUE(test::refuses(nowhere, [&] { create_brick_file(nowhere, table); }));
    EXPECT_TRUE(test::refuses(nowhere, [&] { append_block(nowhere, {}); }));
}

}  // namespace
}  // namespace knap
