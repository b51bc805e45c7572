#include "emit/tiles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace knap {
namespace {

std::vector<LatticeIndex> random_points(std::mt19937_64& random, std::size_t count,
                                        std::int64_t side) {
    std::uniform_int_distribution<std::int64_t> coordinate(-side, side);
    std::vector<LatticeIndex> points(count);
    for (LatticeIndex& point : points) {
        point = {coordinate(random), coordinate(random) / 3, coordinate(random) / 50};
    }
    return points;
}

bool same(const TileSpan& a, const TileSpan& b) {
    return a.first == b.first && a.count == b.count && a.bounds == b.bounds;
}

TEST(Tiles, CoverAllPointsOnceWithinTheLimits) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 300; ++round) {
        const std::size_t count = random() % 5000;
        const std::int64_t side = std::int64_t{1} << (random() % 45);
        const std::uint64_t tile_points = 1 + random() % 700;
        const std::vector<LatticeIndex> given = random_points(random, count, side);
        std::vector<LatticeIndex> points = given;
        const std::vector<TileSpan> tiles = plan_tiles(points, tile_points);

        std::size_t next = 0;
        for (const TileSpan& tile : tiles) {
            EXPECT_EQ(tile.first, next);
            EXPECT_GE(tile.count, 1U);
            EXPECT_LE(tile.count, tile_points);
            next += tile.count;
            const auto part = std::span(points).subspan(tile.first, tile.count);
            EXPECT_EQ(bounds_of(part), tile.bounds);
            EXPECT_TRUE(fits_tile(tile.bounds));
            EXPECT_TRUE(std::is_sorted(part.begin(), part.end()));
        }
        EXPECT_EQ(next, count);
        std::vector<LatticeIndex> sorted_given = given;
        std::vector<LatticeIndex> sorted_planned = points;
        std::sort(sorted_given.begin(), sorted_given.end());
        std::sort(sorted_planned.begin(), sorted_planned.end());
        EXPECT_EQ(sorted_planned, sorted_given);
    }
}

TEST(Tiles, DoNotDependOnTheOrderOfThePoints) {
    std::mt19937_64 random(2);
    for (int round = 0; round < 50; ++round) {
        // Few distinct coordinates: most medians are ties.
        std::vector<LatticeIndex> points = random_points(random, 3000, 1 + round % 9);
        std::vector<LatticeIndex> shuffled = points;
        std::shuffle(shuffled.begin(), shuffled.end(), random);
        const std::vector<TileSpan> tiles = plan_tiles(points, 100);
        const std::vector<TileSpan> tiles_of_shuffled = plan_tiles(shuffled, 100);
        EXPECT_EQ(points, shuffled);
        EXPECT_TRUE(std::equal(tiles.begin(), tiles.end(), tiles_of_shuffled.begin(),
                               tiles_of_shuffled.end(), same));
    }
}

TEST(Tiles, DoNotDependOnTheOrderOfManyPoints) {
    std::mt19937_64 random(3);
    std::vector<LatticeIndex> points = random_points(random, 300000, 200);
    std::vector<LatticeIndex> shuffled = points;
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    const std::vector<TileSpan> tiles = plan_tiles(points, 10000);
    const std::vector<TileSpan> tiles_of_shuffled = plan_tiles(shuffled, 10000);
    EXPECT_EQ(points, shuffled);
    EXPECT_TRUE(std::equal(tiles.begin(), tiles.end(), tiles_of_shuffled.begin(),
                           tiles_of_shuffled.end(), same));
}

TEST(Tiles, AreCutWhereFewPointsLieFarApart) {
    std::vector<LatticeIndex> points{
        {0, 0, 0}, {1, 1, 1}, {(std::int64_t{1} << 20) - 1, 0, 0}, {std::int64_t{1} << 45, 0, 0}};
    const std::vector<TileSpan> tiles = plan_tiles(points, 1000);
    ASSERT_EQ(tiles.size(), 3U);
    EXPECT_EQ(tiles[0].count, 2U);
}

TEST(Tiles, HoldPointsThatShareALatticePoint) {
    std::vector<LatticeIndex> points(1001, LatticeIndex{7, 7, 7});
    std::size_t count = 0;
    for (const TileSpan& tile : plan_tiles(points, 100)) {
        EXPECT_LE(tile.count, 100U);
        count += tile.count;
    }
    EXPECT_EQ(count, 1001U);
}

TEST(Tiles, ThereAreNoneWithoutPoints) {
    EXPECT_TRUE(plan_tiles(std::span<LatticeIndex>(), 1000).empty());
}

}  // namespace
}  // namespace knap
