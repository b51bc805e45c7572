#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "emit/lattice.hpp"
#include "emit/tiles.hpp"
#include "knap/archive.hpp"
#include "tileset/hierarchy.hpp"

namespace knap {

/// Points on their way into a tile of a tileset, in any order.
struct GatheredPoints {
    std::vector<LatticeIndex> points;
    std::vector<std::uint64_t> numbers;  ///< of each, along the curve through the archive
    std::vector<std::byte> rows;         ///< as RowLayout has them

    bool empty() const { return points.empty(); }
    void append(const GatheredPoints& more);
    /// The same in the order of their numbers.
    GatheredPoints in_order() const;
};

/// What a tile of an archive gives to one node.
struct NodeShare {
    std::size_t node = 0;
    LatticeBounds bounds;   ///< of all points of the tile below the node
    GatheredPoints points;  ///< that the node holds; may be none
};

/// Shares the points of a tile of an archive out among the nodes of the hierarchy.
///
/// @param tile    with the archive's attributes
/// @param first   points of the archive before it
/// @param leaves  of the tree, in the order of their points
/// @return        one for each node that has points of the tile below it; no order
/// @throws InputError if a point is off the lattice
std::vector<NodeShare> share_out(const Tile& tile, const Manifest& manifest, std::uint64_t first,
                                 std::span<const TreeNode> tree,
                                 std::span<const std::size_t> leaves);

}  // namespace knap
