#pragma once

#include <limits>

#include "knap/geometry.hpp"

namespace knap {

/// A surface through the points of a simplified cloud, which original points are held against.
class Surface {
  public:
    struct Nearest {
        double distance = 0;  ///< to the surface, cloud units, >= 0
        /// Signed, to the plane of the nearest facet; NaN where the surface has no facets.
        double to_plane = std::numeric_limits<double>::quiet_NaN();
        /// Points of the simplified cloud that are farther than this from p make no difference to
        /// the rest; cloud units, infinite where it is not known.
        double reach = std::numeric_limits<double>::infinity();
    };

    virtual ~Surface() = default;

    /// Thread-safe.
    virtual Nearest nearest(const Vec3& p) const = 0;

    /// Of all facets, cloud units squared; NaN where there are none.
    virtual double area() const { return std::numeric_limits<double>::quiet_NaN(); }
};

}  // namespace knap
