#include "curvature/point_blocks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>

#include "base/threads.hpp"
#include "rank/brick_blocks.hpp"
#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"

namespace knap {
namespace {

constexpr test::Halo kHalos[] = {test::Halo::kPlanned, test::Halo::kNone, test::Halo::kAll};

// A brick of a random cloud, with its halo.
BrickPoints random_brick(std::mt19937_64& random) {
    for (;;) {
        const test::Points points = test::finite_points(test::random_cloud(random));
        test::CutCloud cut =
            test::cut_cloud(random, points, 1 + random() % 300, kHalos[random() % 3]);
        if (!cut.bricks.empty()) {
            return std::move(cut.bricks[random() % cut.bricks.size()].points);
        }
    }
}

// Every point in one block, every block in its nodes, every box no larger than it must be.
void expect_tree(const PointBlocks& blocks) {
    if (blocks.nodes.empty()) {
        ASSERT_EQ(blocks.size(), 0U);
        return;
    }
    ASSERT_EQ(blocks.nodes[0].begin, 0U);
    ASSERT_EQ(blocks.nodes[0].end, blocks.size());
    std::uint32_t next = 0;
    std::size_t leaves = 0;
    for (std::size_t at = 0; at < blocks.nodes.size(); ++at) {
        const PointBlocks::Node& node = blocks.nodes[at];
        Box box;
        for (std::uint32_t place = node.begin; place < node.end; ++place) {
            box.extend(blocks.position(place));
        }
        ASSERT_EQ(box, node.box);
        if (node.right != 0) {
            const PointBlocks::Node& left = blocks.nodes[at + 1];
            const PointBlocks::Node& right = blocks.nodes[at + node.right];
            ASSERT_EQ(left.begin, node.begin);
            ASSERT_EQ(left.end, right.begin);
            ASSERT_EQ(right.end, node.end);
            continue;
        }
        ASSERT_LE(node.end - node.begin, PointBlocks::kBlockPoints);
        ASSERT_EQ(node.begin, next);
        next = node.end;
        ASSERT_EQ(blocks.blocks[leaves++], at);
    }
    ASSERT_EQ(leaves, blocks.blocks.size());
    ASSERT_EQ(next, blocks.size());
}

TEST(PointBlocks, KeepTheLowestIdOfEachPlaceAndCountTheRestOfTheCoreAsMerged) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 200; ++round) {
        const BrickPoints brick = random_brick(random);
        struct Place {
            PointId lowest;
            bool core;
        };
        std::map<std::array<double, 3>, Place> places;
        for (std::size_t i = 0; i < brick.ids.size(); ++i) {
            const Vec3& p = brick.positions[i];
            const bool core = i < brick.core_count;
            const auto [at, added] = places.try_emplace({p.x, p.y, p.z}, Place{brick.ids[i], core});
            at->second.lowest = std::min(at->second.lowest, brick.ids[i]);
            ASSERT_EQ(at->second.core, core) << "one voxel, one owner";
        }
        const PointBlocks blocks = block_brick(brick);
        ASSERT_NO_FATAL_FAILURE(expect_tree(blocks));
        ASSERT_EQ(blocks.size(), places.size());
        std::uint64_t core = 0;
        for (std::size_t i = 0; i < blocks.size(); ++i) {
            const Vec3 p = blocks.position(i);
            const auto place = places.extract(std::array{p.x, p.y, p.z});
            ASSERT_FALSE(place.empty()) << "each place once";
            ASSERT_EQ(blocks.ids[i], place.mapped().lowest);
            ASSERT_EQ(blocks.is_core[i] != 0, place.mapped().core);
            core += blocks.is_core[i];
        }
        ASSERT_EQ(blocks.core_count, core);
        ASSERT_EQ(blocks.core_count + blocks.merged, brick.core_count);
    }
}

TEST(PointBlocks, AreMadeInParallelToo) {
    std::mt19937_64 random(2);
    std::vector<TaggedPoint> points;
    for (PointId id = 0; id < 300000; ++id) {
        const auto coordinate = [&] { return static_cast<double>(random() % 300) / 8; };
        // A third of the points share their place with another; some places are crowded.
        points.emplace_back(
            id % 1000 == 0 ? Vec3{1, 2, 3} : Vec3{coordinate(), coordinate(), coordinate() / 60},
            id, true);
    }
    std::vector<PointId> expected;
    for (const int threads : {1, 2, 4}) {
        const ThreadLimit limit(threads);
        std::shuffle(points.begin(), points.end(), random);
        const PointBlocks blocks = make_blocks(points);
        ASSERT_NO_FATAL_FAILURE(expect_tree(blocks));
        ASSERT_EQ(blocks.core_count + blocks.merged, points.size());
        std::vector<PointId> ids = blocks.ids;
        std::sort(ids.begin(), ids.end());
        if (expected.empty()) {
            expected = ids;
        }
        ASSERT_EQ(ids, expected) << "the same points stay, whatever their order";
    }
    ASSERT_LT(expected.size(), points.size());
}

TEST(PointBlocks, TakeZeroOfEitherSignForOnePlace) {
    const PointBlocks blocks =
        block_brick({{{0.0, 1, -0.0}, {-0.0, 1, 0.0}, {0.0, 2, 0.0}}, {5, 3, 9}, 3});
    EXPECT_EQ(blocks.merged, 1U);
    EXPECT_EQ(blocks.core_count, 2U);
    EXPECT_NE(std::find(blocks.ids.begin(), blocks.ids.end(), 3U), blocks.ids.end());
}

TEST(PointBlocks, OfAnyNumberOfPointsInOnePlaceAreOnePoint) {
    for (const PointId count : {1, 2, 31, 33, 1000}) {
        std::vector<TaggedPoint> points;
        for (PointId id = 0; id < count; ++id) {
            points.emplace_back(Vec3{7, 8, 9}, 5 + (id * 7919) % count, true);
        }
        const PointBlocks blocks = make_blocks(points);
        ASSERT_EQ(blocks.ids, (std::vector<PointId>{5}));
        ASSERT_EQ(blocks.merged, count - 1);
    }
}

TEST(PointBlocks, OfNothingAreEmpty) {
    const PointBlocks blocks = make_blocks({});
    EXPECT_EQ(blocks.size(), 0U);
    EXPECT_TRUE(blocks.blocks.empty());
    EXPECT_EQ(blocks.core_count + blocks.merged, 0U);
}

}  // namespace
}  // namespace knap
