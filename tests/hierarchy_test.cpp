#include "tileset/hierarchy.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "tileset/properties.hpp"
#include "tileset/tileset_index.hpp"

namespace knap {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(Hierarchy, ChildrenHaveWhatTheirParentHasAndLeavesFitATile) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 200; ++round) {
        std::vector<std::uint64_t> tiles(random() % 60);
        std::uint64_t all = 0;
        for (std::uint64_t& points : tiles) {
            points = 1 + random() % (round % 2 == 0 ? 1000000 : 20000);
            all += points;
        }
        const std::vector<TreeNode> tree = plan_tree(tiles);
        ASSERT_EQ(tree.empty(), all == 0);
        if (tree.empty()) {
            continue;
        }
        EXPECT_EQ(tree[0].points, all);
        EXPECT_EQ(tree[0].tiles, tiles.size());
        for (std::size_t i = 0; i < tree.size(); ++i) {
            const TreeNode& node = tree[i];
            ASSERT_GT(node.points, 0);
            EXPECT_EQ(node.leaf(), node.points <= kTilesetPoints);
            EXPECT_EQ(node.leaf(), node.shown == 1);
            EXPECT_LE(node.children.size(), 8);
            std::uint64_t next = node.first;
            for (const std::size_t child : node.children) {
                ASSERT_GT(child, i);
                EXPECT_EQ(tree[child].parent, i);
                EXPECT_EQ(tree[child].first, next);
                EXPECT_GT(tree[child].shown, node.shown);
                next += tree[child].points;
            }
            if (!node.leaf()) {
                EXPECT_EQ(next, node.first + node.points);
            }
        }
    }
}

TEST(Hierarchy, NoNodeHoldsMuchMoreThanATile) {
    const std::vector<TreeNode> tree = plan_tree(std::vector<std::uint64_t>(64, 90000));
    std::vector<std::uint64_t> held(tree.size());
    for (std::size_t leaf = 0; leaf < tree.size(); ++leaf) {
        for (std::uint64_t i = 0; tree[leaf].leaf() && i < tree[leaf].points; ++i) {
            ++held[holder_of(tree, leaf, tree[leaf].first + i)];
        }
    }
    for (const std::uint64_t points : held) {
        EXPECT_GT(points, 0);
        EXPECT_LE(points, kTilesetPoints + 64);
    }
}

TEST(Hierarchy, AnyLimitTakesPointsEvenly) {
    for (const double limit : {0.001, 0.1, 0.37, 0.5}) {
        for (std::uint64_t first : {0, 12345, 99999999}) {
            int taken = 0;
            for (std::uint64_t i = first; i < first + 100000; ++i) {
                taken += rank_of(i) < limit ? 1 : 0;
            }
            EXPECT_NEAR(taken, 100000 * limit, 40) << limit << " " << first;
        }
    }
}

TEST(TilesetIndex, ErrorsGrowTowardsTheRootWhateverTheSpacing) {
    const std::vector<TreeNode> tree = plan_tree(std::vector<std::uint64_t>(64, 90000));
    std::vector<WrittenNode> written(tree.size());
    for (std::size_t i = 0; i < tree.size(); ++i) {
        written[i].spacing = static_cast<double>(i);  // least at the root
        written[i].placement.box = {{0, 0, 0}, {1, 1, 1}};
        written[i].placement.matrix = matrix_of(local_frame({}), {1, 1, 1});
        // Every other one in two files.
        written[i].parts.resize(1 + i % 2, {written[i].placement, {"a.pnts", 10, 1, "0"}});
    }
    Tileset tileset;
    add_nodes(tileset, tree, written);
    EXPECT_EQ(tileset.points, 10 * tree.size() + 10 * (tree.size() / 2));
    EXPECT_GT(tileset.geometric_error, tileset.nodes[0].geometric_error);
    for (const TilesetNode& node : tileset.nodes) {
        for (const std::size_t child : node.children) {
            EXPECT_LT(tileset.nodes[child].geometric_error, node.geometric_error);
        }
    }
}

TEST(Properties, AreAsManyAsAViewerLoadsAndTheFlagsOfLasGoLast) {
    std::vector<Attribute> attributes{{"scan_direction", ScalarType::kUint8},
                                      {"red", ScalarType::kUint8},
                                      {"green", ScalarType::kUint8},
                                      {"blue", ScalarType::kUint8},
                                      {"wide", ScalarType::kUint64},
                                      {"many", ScalarType::kUint8, 5},
                                      {"RGB", ScalarType::kUint8},
                                      {"nx", ScalarType::kFloat32},
                                      {"ny", ScalarType::kFloat32},
                                      {"nz", ScalarType::kFloat32}};
    const PropertyPlan few = plan_properties(attributes);
    EXPECT_THAT(few.color, ElementsAre(1, 2, 3));
    EXPECT_THAT(few.normal, ElementsAre(7, 8, 9));
    ASSERT_EQ(few.properties.size(), 2);
    EXPECT_EQ(few.properties[0].name, "scan_direction");
    EXPECT_EQ(few.properties[1].name, "RGB_");
    EXPECT_THAT(few.left_out, ElementsAre("wide", "many"));
    for (int i = 0; i < 11; ++i) {
        attributes.push_back({"extra" + std::to_string(i), ScalarType::kFloat64});
    }
    const PropertyPlan many = plan_properties(attributes);
    EXPECT_EQ(many.properties.size(), 12);
    EXPECT_THAT(many.left_out, ElementsAre("scan_direction", "wide", "many"));
}

}  // namespace
}  // namespace knap
