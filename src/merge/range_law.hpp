#pragma once

#include "knap/params.hpp"
#include "merge/region.hpp"
#include "store/ranked_run.hpp"

namespace knap {

/// What a job says of ranges, with the alpha that follows from a tolerance and the chord law.
/// @param mean_curvature  of the archive, 1 / cloud unit, >= 0
RangeParams with_alpha(const RangeParams& range, double mean_curvature);

/// The radius that a point stands for, from its curvature (method section 3). It never grows with
/// the curvature, so that ranges never decrease along the method's order.
class RangeLaw {
  public:
    /// @param range           valid
    /// @param mean_curvature  of the archive, 1 / cloud unit, >= 0
    RangeLaw(const RangeParams& range, double mean_curvature)
        : range_(range), shape_(range), mean_curvature_(mean_curvature) {}

    /// @param curvature  |H| of the point, >= 0; 0 gives the largest radius
    /// @return           > 0, cloud units; may be infinite
    double of(double curvature) const;

    /// No point of this curvature stands for one that is farther away. It does not grow with the
    /// curvature either.
    double reach(double curvature) const;

    /// What a kept point stands for.
    Region region(const RankedPoint& point) const;

    const RegionShape& shape() const { return shape_; }

  private:
    RangeParams range_;
    RegionShape shape_;
    double mean_curvature_;
};

}  // namespace knap
