#pragma once

#include <span>

#include "store/tileset_file.hpp"
#include "tileset/hierarchy.hpp"
#include "tileset/node_writer.hpp"

namespace knap {

/// Fills in the nodes, errors and points of a tileset. A node of one file is one tile. One of
/// several is a tile without content; its children are the files, and a tile without content that
/// has the node's own children.
/// @param tree     the root first; none: no points
/// @param written  of each node of the tree
void add_nodes(Tileset& tileset, std::span<const TreeNode> tree,
               std::span<const WrittenNode> written);

}  // namespace knap
