#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "knap/geometry.hpp"

namespace knap {

/// A point found near another.
struct Neighbour {
    double squared_distance = 0;  ///< cloud units squared
    std::uint32_t index = 0;      ///< in the cloud that was searched
};

/// Exact nearest neighbours in a cloud without coincident points, by FLANN's single kd-tree.
///
/// Where several points are equally far, the lowest ids win: the tree is searched a little beyond
/// the k-th distance, so that its order of traversal decides nothing.
class NeighbourSearch {
  public:
    /// @param points  finite, fewer than 2^31; must outlive the search
    /// @param ids     one id a point; must outlive the search
    NeighbourSearch(std::span<const Vec3> points, std::span<const PointId> ids);
    ~NeighbourSearch();
    NeighbourSearch(const NeighbourSearch&) = delete;
    NeighbourSearch& operator=(const NeighbourSearch&) = delete;

    /// The k nearest points to `query` whose id is not `self`, by (distance, id), nearest first;
    /// fewer if the cloud has fewer. Thread-safe.
    /// @param result       replaced; its capacity is reused
    /// @param max_squared  points farther than this, squared, do not count
    void nearest(const Vec3& query, PointId self, std::size_t k, std::vector<Neighbour>& result,
                 double max_squared = std::numeric_limits<double>::infinity()) const;

    /// Bytes a point that a search holds beside the caller's points and ids, for planning.
    static constexpr std::uint64_t kBytesPerPoint = 72;

  private:
    struct Tree;
    std::span<const Vec3> points_;
    std::span<const PointId> ids_;
    std::unique_ptr<Tree> tree_;
};

}  // namespace knap
