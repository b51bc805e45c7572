#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "curvature/neighbour_search.hpp"
#include "surface/surface.hpp"

namespace knap {

/// A surface without a mesh: round each point the fan of triangles that it has in the Delaunay
/// triangulation of its neighbours, seen along their normal. Fans of neighbouring points need not
/// agree; the distance is that to the nearest triangle of the fans near by. Source: Linsen and
/// Prautzsch, Fan Clouds, 2003.
class FanSurface final : public Surface {
  public:
    /// @param points  of the simplified cloud, finite, distinct, fewer than 2^31
    /// @throws ConfigError if there are none
    explicit FanSurface(std::vector<Vec3> points);

    /// A part of a cloud.
    /// @param ids      of the points, below 2^64 - 1: which of equally near ones count
    /// @param farthest points that are farther than this from each other, or from a point that is
    ///                 held against the surface, have nothing to do with each other; > 0, cloud
    ///                 units
    FanSurface(std::vector<Vec3> points, std::vector<PointId> ids, double farthest);

    Nearest nearest(const Vec3& p) const override { return nearest(p, -1); }

    /// The same, but any distance up to `enough` is as good as the smallest.
    Nearest nearest(const Vec3& p, double enough) const;

    /// Bytes of memory that a point takes, for planning.
    static constexpr std::uint64_t kBytesPerPoint =
        24 + 8 + NeighbourSearch::kBytesPerPoint + 64 + 16;

  private:
    double add_fan(std::size_t i, std::vector<Neighbour>& neighbours,
                   std::vector<std::uint32_t>& out) const;

    std::vector<Vec3> points_;
    std::vector<PointId> ids_;
    double farthest_ = std::numeric_limits<double>::infinity();
    std::unique_ptr<NeighbourSearch> search_;
    std::vector<std::uint32_t> rim_;   // pairs of points: with its centre, each is a triangle
    std::vector<std::size_t> begins_;  // fan i is rim_[begins_[i]] .. rim_[begins_[i + 1]]
    std::vector<double> reaches_;  // what is farther from point i makes no difference to its fan
};

}  // namespace knap
