#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace knap {

/// Points that one tile of a tileset aims at, and at most about which it holds.
inline constexpr std::uint64_t kTilesetPoints = std::uint64_t{1} << 16;

/// A node of the hierarchy: consecutive points of an archive, in the order of its tiles.
struct TreeNode {
    static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

    std::size_t parent = kNone;         ///< the root has none; comes before its children
    std::uint64_t first = 0;            ///< of the points
    std::uint64_t points = 0;           ///< below the node, its own included
    std::size_t first_tile = 0;         ///< of the archive
    std::size_t tiles = 0;              ///< that have points of it
    double shown = 1;                   ///< share of its points that it and its ancestors hold
    std::vector<std::size_t> children;  ///< none: a leaf

    bool leaf() const { return children.empty(); }
};

/// The hierarchy of an archive: halved as the archive was, by the number of points, three times a
/// level. Known before a point is read.
///
/// @param tile_points  of each tile of the archive, in their order
/// @return             the root first; none if there are no points. Within a tile of the archive
///                     leaves are what plan_tiles() makes of it with kTilesetPoints.
std::vector<TreeNode> plan_tree(std::span<const std::uint64_t> tile_points);

/// A number in [0, 1) of each point such that those below any limit are spread evenly over the
/// order of points: van der Corput's sequence.
double rank_of(std::uint64_t point);

/// The node that holds a point: the highest above the leaf that still shows it.
std::size_t holder_of(std::span<const TreeNode> tree, std::size_t leaf, std::uint64_t point);

}  // namespace knap
