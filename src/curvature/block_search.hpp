#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "curvature/neighbourhoods.hpp"
#include "curvature/point_blocks.hpp"

namespace knap {

struct BlockSearchWork;

/// Exact nearest neighbours of all points of a block at once.
///
/// The points around a block are gathered once; for each of its points all distances are computed
/// with vector instructions, and the k-th smallest is closed in on by counting, without sorting.
/// What it finds is certain: a neighbourhood that reaches as far as the points were gathered is
/// searched for again, farther. Which instructions are used makes no difference to the result.
class BlockSearch {
  public:
    /// @param points   must outlive the search
    /// @param centres  for each place 1 if its neighbourhood is wanted; must outlive the search
    /// @param k        neighbours wanted, [1, 255]
    BlockSearch(const PointBlocks& points, std::span<const std::uint8_t> centres, std::size_t k);
    ~BlockSearch();
    BlockSearch(const BlockSearch&) = delete;
    BlockSearch& operator=(const BlockSearch&) = delete;

    /// For each centre in a block: itself and its k nearest other points by (squared distance,
    /// id); fewer if there are fewer. Valid until the next call. For one thread: blocks that
    /// follow each other are searched best by one object in turn.
    const Neighbourhoods& around(std::size_t block);

  private:
    std::unique_ptr<BlockSearchWork> work_;
};

}  // namespace knap
