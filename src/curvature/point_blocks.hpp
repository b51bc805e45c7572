#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "knap/geometry.hpp"

namespace knap {

/// A point on its way into blocks.
class TaggedPoint {
  public:
    /// @param id       below 2^63
    /// @param is_core  the brick owns the point; else it is halo
    TaggedPoint(const Vec3& at, PointId id, bool is_core)
        : position(at), tag_(id << 1 | (is_core ? 1 : 0)) {}

    PointId id() const { return tag_ >> 1; }
    bool is_core() const { return (tag_ & 1) != 0; }

    Vec3 position;

  private:
    std::uint64_t tag_;
};

/// The distinct points of a brick in small blocks of near ones, and the boxes of blocks in a tree:
/// halved across the longest axis until a block is small, so that blocks follow the local density.
struct PointBlocks {
    /// A node and its two subtrees, which follow it: the left one next, the right one `right`
    /// places on. A leaf has right == 0 and is one block.
    struct Node {
        Box box;                  ///< of its points
        std::uint32_t begin = 0;  ///< its points are [begin, end)
        std::uint32_t end = 0;
        std::uint32_t right = 0;
    };

    /// Most points of a block. Twice as many or half as many cost a search a few percent.
    static constexpr std::size_t kBlockPoints = 32;
    /// Values that may be read past the last coordinate.
    static constexpr std::size_t kPadding = 16;

    std::vector<double> x;  ///< coordinates by place; padded
    std::vector<double> y;
    std::vector<double> z;
    std::vector<PointId> ids;
    std::vector<std::uint8_t> is_core;
    std::vector<Node> nodes;            ///< the root first; none if there are no points
    std::vector<std::uint32_t> blocks;  ///< the leaf of each block, in order of their points
    std::uint64_t core_count = 0;       ///< of distinct core points
    std::uint64_t merged = 0;           ///< core points that one with a lower id stands for

    std::size_t size() const { return ids.size(); }
    Vec3 position(std::size_t place) const { return {x[place], y[place], z[place]}; }

    /// Bytes of memory a point while blocks are made, and afterwards.
    static constexpr std::uint64_t kMakingBytesPerPoint = 80;
    static constexpr std::uint64_t kBytesPerPoint = 48;
};

/// Puts points into blocks and merges coincident ones into the one of lowest id. The set of points
/// that comes out depends on the set that goes in alone; their order does not matter to anyone.
/// @param points  finite, fewer than 2^32; coincident ones are core or halo together
PointBlocks make_blocks(std::vector<TaggedPoint> points);

}  // namespace knap
