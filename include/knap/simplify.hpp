#pragma once

#include <span>
#include <vector>

#include "knap/export.hpp"
#include "knap/geometry.hpp"
#include "knap/job.hpp"
#include "knap/params.hpp"

namespace knap {

struct SimplifyParams {
    CurvatureParams curvature;
    RangeParams range;  ///< alpha must be set
    int threads = 0;    ///< [0, 1024]; 0: one a core; does not change the result
};

struct SimplifyResult {
    std::vector<PointId> kept;  ///< indices into the points given, ascending
    Counts counts;
    double spacing = 0;         ///< mean distance to the nearest other point, cloud units
    double mean_curvature = 0;  ///< mean |H|, 1 / cloud unit
    double alpha = 0;           ///< range at mean curvature, given or found, cloud units
};

/// Feature-preserving simplification of a cloud in memory: the out-of-core code with one brick.
///
/// @param points  any number, cloud units; non-finite ones are rejected and counted
/// @return        the points that carry the shape
/// @throws ConfigError if a parameter is out of range
/// @note the same for any thread count
/// @see Yang, Matsuyama, Konno, Tokuyama 2015
KNAP_API SimplifyResult simplify(std::span<const Vec3> points, const SimplifyParams& params);

}  // namespace knap
