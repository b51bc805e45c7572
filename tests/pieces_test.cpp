#include "merge/pieces.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "support/clouds.hpp"

namespace knap {
namespace {

std::vector<RankedPoint> any_points(const std::vector<Vec3>& cloud) {
    std::vector<RankedPoint> points;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
        if (is_finite(cloud[i])) {
            points.push_back({static_cast<double>(i % 7), i, cloud[i]});
        }
    }
    return points;
}

TEST(Pieces, HoldEachPointOnceInTheOrderThatItHadWithItsRange) {
    const RangeLaw range({.alpha = 0.5}, 2);
    std::mt19937_64 random(1);
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
        const std::vector<RankedPoint> points = any_points(test::random_cloud(random));
        const Pieces pieces = cut_into_pieces(points, range, 1 + seed * seed % 300);
        std::vector<std::uint8_t> met(points.size());
        ASSERT_EQ(pieces.begins.size(), pieces.count() + 1) << "seed " << seed;
        for (std::size_t piece = 0; piece < pieces.count(); ++piece) {
            const auto places = pieces.places_of(piece);
            EXPECT_TRUE(std::is_sorted(places.begin(), places.end())) << "seed " << seed;
            Box box;
            for (std::size_t i = 0; i < places.size(); ++i) {
                const RankedPoint& point = points[places[i]];
                EXPECT_EQ(pieces.points_of(piece)[i].position, point.position);
                EXPECT_EQ(pieces.points_of(piece)[i].reach, range.of(point.key));
                box.extend(point.position);
                ++met[places[i]];
            }
            EXPECT_EQ(pieces.boxes[piece].min, box.min) << "seed " << seed;
            EXPECT_EQ(pieces.boxes[piece].max, box.max) << "seed " << seed;
        }
        EXPECT_THAT(met, testing::Each(1)) << "seed " << seed;
    }
}

TEST(Pieces, AreSmallAndLieApart) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> place(0, 1);
    std::vector<Vec3> cloud(200'000);
    for (Vec3& p : cloud) {
        p = {place(random) * 100, place(random) * 100, place(random)};
    }
    constexpr std::size_t kPiecePoints = 5000;
    const Pieces pieces = cut_into_pieces(any_points(cloud), RangeLaw({}, 1), kPiecePoints);
    EXPECT_GE(pieces.count(), cloud.size() / kPiecePoints);
    for (std::size_t a = 0; a < pieces.count(); ++a) {
        EXPECT_LT(pieces.points_of(a).size(), 2 * kPiecePoints);
        for (std::size_t b = 0; b < a; ++b) {
            EXPECT_GT(pieces.boxes[a].squared_distance_to(pieces.boxes[b]), 0);
        }
    }
}

}  // namespace
}  // namespace knap
