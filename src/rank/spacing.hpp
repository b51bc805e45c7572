#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/exact_sum.hpp"
#include "curvature/point_blocks.hpp"
#include "rank/gather.hpp"

namespace knap {

/// Chooses the points whose nearest-neighbour distances make up the spacing: by a hash of the id,
/// so that the choice does not depend on how the archive is cut. All of up to a million points; a
/// million and a quarter of more, so that a million are left where some coincide.
class SpacingSample {
  public:
    /// @param points  finite points of the archive
    explicit SpacingSample(std::uint64_t points);
    bool contains(PointId id) const;
    /// Of all points, about.
    double share() const;

  private:
    std::uint64_t threshold_;
};

/// The part of the spacing that one brick knows.
struct BrickSpacing {
    ExactSum sum;                       ///< of nearest-neighbour distances, cloud units
    std::uint64_t count = 0;            ///< distances in the sum
    std::vector<Straggler> stragglers;  ///< sampled points whose neighbour may be in another brick
};

/// Distances from the sampled core points of a brick to their nearest other points.
/// @param halo     the brick holds every point of the archive in this box
/// @param archive  box of all points
BrickSpacing brick_spacing(const PointBlocks& brick, const SpacingSample& sample, const Box& halo,
                           const Box& archive);

/// The same where the sample is a small share of the points: only those near sampled ones are put
/// into blocks, in ever wider cells around the samples whose neighbour is not found yet.
/// @param points  of the brick, core and halo
BrickSpacing sparse_spacing(std::vector<TaggedPoint> points, const SpacingSample& sample,
                            const Box& halo, const Box& archive);

}  // namespace knap
