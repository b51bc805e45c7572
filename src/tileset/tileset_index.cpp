#include "tileset/tileset_index.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace knap {

namespace {

// Errors grow towards the root, so that a viewer takes parents first.
constexpr double kLeastGrowth = 1.5;
// A tile without content is opened nearly as soon as its parent.
constexpr double kOfParent = 1 / 1.2;

constexpr Matrix kSame{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

/// By how much the surface may seem off where a node is shown and its children are not: about the
/// spacing of its points. Of every node, parents first.
std::vector<double> errors_of(std::span<const TreeNode> tree,
                              std::span<const WrittenNode> written) {
    std::vector<double> errors(tree.size());
    for (std::size_t i = tree.size(); i-- > 0;) {  // children first
        if (tree[i].leaf()) {
            continue;
        }
        errors[i] = written[i].spacing;
        for (const std::size_t child : tree[i].children) {
            errors[i] = std::max(errors[i], kLeastGrowth * errors[child]);
        }
        if (errors[i] <= 0) {  // all points in one place
            errors[i] = written[i].placement.box.diagonal();
        }
    }
    return errors;
}

}  // namespace

void add_nodes(Tileset& tileset, std::span<const TreeNode> tree,
               std::span<const WrittenNode> written) {
    const std::vector<double> errors = errors_of(tree, written);
    tileset.nodes.resize(tree.size());
    if (!tree.empty()) {
        tileset.geometric_error =
            std::max(written.front().placement.box.diagonal(), 2 * errors.front());
    }
    for (std::size_t i = 0; i < tree.size(); ++i) {
        const Placement& placement = written[i].placement;
        const bool root = tree[i].parent == TreeNode::kNone;
        TilesetNode node;
        node.box = placement.box;
        node.transform =
            root ? placement.matrix
                 : relative_to(written[tree[i].parent].placement.matrix, placement.matrix);
        node.geometric_error = errors[i];
        node.children = tree[i].children;
        for (const NodePart& part : written[i].parts) {
            tileset.points += part.content.points;
            tileset.largest_error = std::max(tileset.largest_error, part.placement.largest_error);
        }
        if (written[i].parts.size() == 1) {
            node.content = written[i].parts.front().content;
        } else {
            TilesetNode below = node;
            below.transform = kSame;
            node.geometric_error =
                (root ? tileset.geometric_error : errors[tree[i].parent]) * kOfParent;
            node.children.clear();
            for (const NodePart& part : written[i].parts) {
                node.children.push_back(tileset.nodes.size());
                tileset.nodes.push_back(
                    {.transform = relative_to(placement.matrix, part.placement.matrix),
                     .box = part.placement.box,
                     .geometric_error = 0,
                     .content = part.content,
                     .children = {}});
            }
            if (!below.children.empty()) {
                node.children.push_back(tileset.nodes.size());
                tileset.nodes.push_back(std::move(below));
            }
        }
        tileset.nodes[i] = std::move(node);
    }
}

}  // namespace knap
