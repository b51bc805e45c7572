#pragma once

#include "knap/geometry.hpp"

namespace knap {

/// Squared distance from a point to a triangle, which may be degenerate. Source: Ericson,
/// Real-Time Collision Detection, 2005, section 5.1.5.
double squared_distance_to_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace knap
