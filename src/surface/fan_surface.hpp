#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
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
        24 + 8 + NeighbourSearch::kBytesPerPoint + 40 + 96;

  private:
    struct Fan {
        std::vector<std::uint32_t> rim;  ///< pairs of points: with the centre, each is a triangle
        double reach = 0;  ///< what is farther from the centre makes no difference to the fan
    };

    const Fan& fan_of(std::uint32_t centre) const;
    Fan make(std::uint32_t centre) const;

    std::vector<Vec3> points_;
    std::vector<PointId> ids_;
    double farthest_ = std::numeric_limits<double>::infinity();
    std::unique_ptr<NeighbourSearch> search_;
    // Made when a point is first held against them: of a part of a cloud many never are.
    mutable std::vector<std::once_flag> made_;
    mutable std::vector<Fan> fans_;
};

}  // namespace knap
