#pragma once

#include <functional>
#include <vector>

#include "knap/geometry.hpp"
#include "store/ranked_run.hpp"

namespace knap {

/// What the points that are not kept are held to.
struct SurfaceLimit {
    double distance = 0;  ///< to the surface through the kept points, >= 0, cloud units
    /// Kept points that are farther apart than this have no facet in common; > 0, finite, cloud
    /// units.
    double farthest = 0;
    /// How far round the points kept ones are looked at first; > 0, cloud units.
    double radius = 0;
};

/// Kept points: at least all that are within a radius of a box.
using KeptNear = std::function<std::vector<RankedPoint>(const Box& box, double radius)>;

/// Points that are farther from the surface through the kept points (FanSurface) than they may be,
/// by their distance: `key` is the distance, cloud units, and they are in the method's order.
///
/// Each distance is certain: kept points are asked for round the points in growing radii, until
/// none beyond could make a difference. So which other points are asked about makes none either.
/// @param points  not kept, in any order
std::vector<RankedPoint> find_violators(std::vector<RankedPoint> points, const SurfaceLimit& limit,
                                        const KeptNear& kept_near);

/// Bytes of memory that find_violators() takes for each point, and for each kept point near by.
std::uint64_t violator_bytes_per_point();
std::uint64_t violator_bytes_per_kept();

}  // namespace knap
