#include "store/ranked_run.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "support/clouds.hpp"
#include "support/damage.hpp"
#include "support/random_table.hpp"

namespace knap {
namespace {

bool same(const RankedPoint& a, const RankedPoint& b) {
    return a.key == b.key && a.id == b.id && a.position == b.position && a.frame == b.frame;
}

bool same(const std::vector<RankedPoint>& a, const std::vector<RankedPoint>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const RankedPoint& p, const RankedPoint& q) { return same(p, q); });
}

// Keys of any magnitude, many of them equal; in the method's order.
std::vector<RankedPoint> random_points(std::mt19937_64& random, const SourceTable& table,
                                       std::size_t count, bool frames = false) {
    std::vector<RankedPoint> points(count);
    for (RankedPoint& point : points) {
        point.key = random() % 4 == 0 ? static_cast<double>(random() % 3)
                                      : std::ldexp(1.0 + static_cast<double>(random() % 1000),
                                                   static_cast<int>(random() % 2000) - 1070);
        point.id = random() % table.points();
        point.position = test::random_position(random, table, table.source_of(point.id));
        if (frames && random() % 8 != 0) {
            point.frame =
                PackedFrame(PackedFrame::Bytes{static_cast<std::uint8_t>(random() % 255),
                                               static_cast<std::uint8_t>(random() % 255),
                                               static_cast<std::uint8_t>(random() % 256)});
        }
    }
    std::sort(points.begin(), points.end(),
              [](const RankedPoint& a, const RankedPoint& b) { return ranks_before(a, b); });
    return points;
}

void write(const std::filesystem::path& path, const SourceTable& table,
           const std::vector<RankedPoint>& points, std::size_t block_points, bool frames = false) {
    std::filesystem::remove(path);
    RunWriter writer(path, table, {.block_points = block_points, .frames = frames});
    for (const RankedPoint& point : points) {
        writer.add(point);
    }
    EXPECT_FALSE(std::filesystem::exists(path)) << "exists before it is finished";
    const std::uint64_t bytes = writer.finish();
    EXPECT_EQ(std::filesystem::file_size(path), bytes);
}

std::vector<RankedPoint> read(const std::filesystem::path& path, const SourceTable& table,
                              std::size_t most = std::numeric_limits<std::size_t>::max()) {
    RunReader reader(path, table);
    std::vector<RankedPoint> all;
    for (std::vector<RankedPoint> block; reader.next(block);) {
        EXPECT_FALSE(block.empty());
        EXPECT_LE(block.size(), most);
        all.insert(all.end(), block.begin(), block.end());
    }
    std::vector<RankedPoint> after;
    EXPECT_FALSE(reader.next(after));
    EXPECT_TRUE(after.empty());
    return all;
}

class RankedRun : public testing::Test {
  protected:
    test::TemporaryFolder folder_;
    std::filesystem::path path_ = folder_ / "000000.run";
    std::mt19937_64 random_{11};
};

TEST_F(RankedRun, GivesBackWhatWasWrittenForAnyBlockSizeAndTable) {
    for (int round = 0; round < 300; ++round) {
        const std::uint64_t most_ids = std::uint64_t{1} << (random_() % 40 + 1);
        const SourceTable table = test::random_table(random_, round % 2 == 0, most_ids);
        const bool frames = random_() % 2 == 0;
        const auto points = random_points(random_, table, random_() % 300, frames);
        const std::size_t block_points = 1 + random_() % 100;
        write(path_, table, points, block_points, frames);
        ASSERT_TRUE(same(read(path_, table, block_points), points)) << "round " << round;
    }
}

TEST_F(RankedRun, HoldsKeysFromZeroToInfinity) {
    const SourceTable table = test::random_table(random_, false);
    const Vec3 position = test::random_position(random_, table, 0);
    std::vector<RankedPoint> points;
    for (const double key :
         {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::max(), 1.0,
          std::numeric_limits<double>::min(), std::numeric_limits<double>::denorm_min(), 0.0}) {
        points.push_back({key, 0, position});
    }
    write(path_, table, points, 64);
    EXPECT_TRUE(same(read(path_, table), points));
}

TEST_F(RankedRun, ABitFlippedInABlockIsAnErrorAndInTheHeaderNeverChangesThePoints) {
    for (const bool wide : {false, true}) {
        const SourceTable table = test::random_table(random_, wide);
        const auto points = random_points(random_, table, 7, wide);
        write(path_, table, points, 3, wide);
        constexpr std::size_t kHeaderSize = 28;
        test::with_each_bit_flipped(path_, [&](std::size_t at) {
            std::vector<RankedPoint> found;
            if (!test::refuses(path_, [&] { found = read(path_, table); })) {
                EXPECT_LT(at, kHeaderSize);
                EXPECT_TRUE(same(found, points));
            }
        });
    }
}

TEST_F(RankedRun, LeavesFramesOutUnlessTold) {
    const SourceTable table = test::random_table(random_, false);
    auto points = random_points(random_, table, 100, true);
    write(path_, table, points, 16);
    const std::uint64_t without = std::filesystem::file_size(path_);
    for (RankedPoint& point : points) {
        point.frame = PackedFrame();
    }
    EXPECT_TRUE(same(read(path_, table), points));
    write(path_, table, points, 16, true);
    EXPECT_EQ(std::filesystem::file_size(path_), without + 300);
}

TEST_F(RankedRun, CutAnywhereIsAnErrorNamingTheFile) {
    const SourceTable table = test::random_table(random_, false);
    write(path_, table, random_points(random_, table, 7), 3);
    test::with_each_cut(path_, [&](std::size_t size) {
        EXPECT_TRUE(test::refuses(path_, [&] { read(path_, table); })) << size << " bytes";
    });
}

TEST_F(RankedRun, OfAnotherTableOrMissingIsAnErrorNamingIt) {
    const SourceTable narrow = test::random_table(random_, false);
    const SourceTable wide = test::random_table(random_, true);
    EXPECT_TRUE(test::refuses(path_, [&] { read(path_, narrow); }));
    write(path_, narrow, random_points(random_, narrow, 7), 3);
    EXPECT_TRUE(test::refuses(path_, [&] { read(path_, wide); }));
    std::filesystem::remove(path_);
    const std::filesystem::path nowhere = folder_ / "none" / "000000.run";
    EXPECT_TRUE(test::refuses(nowhere, [&] { RunWriter(nowhere, narrow); }));
}

TEST_F(RankedRun, ThatIsNotFinishedLeavesNothing) {
    const SourceTable table = test::random_table(random_, false);
    { RunWriter(path_, table).add({1, 0, test::random_position(random_, table, 0)}); }
    EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST(RanksBefore, IsATotalOrderByKeyThenHashThenId) {
    std::mt19937_64 random(3);
    std::vector<RankedPoint> points(60);
    for (RankedPoint& point : points) {
        point.key = static_cast<double>(random() % 3);
        point.id = random() % 50;
    }
    for (const RankedPoint& a : points) {
        for (const RankedPoint& b : points) {
            const bool equal = a.key == b.key && a.id == b.id;
            EXPECT_EQ(ranks_before(a, b) + ranks_before(b, a), equal ? 0 : 1);
            if (a.key > b.key || (a.key == b.key && splitmix64(a.id) < splitmix64(b.id))) {
                EXPECT_TRUE(ranks_before(a, b));
            }
            for (const RankedPoint& c : points) {
                EXPECT_TRUE(!ranks_before(a, b) || !ranks_before(b, c) || ranks_before(a, c));
            }
        }
    }
}

}  // namespace
}  // namespace knap
