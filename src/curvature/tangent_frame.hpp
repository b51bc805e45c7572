#pragma once

#include <cstddef>

#include "curvature/principal_axes.hpp"
#include "curvature/quadric.hpp"
#include "store/local_frame.hpp"

namespace knap {

/// The tangent plane and principal directions of a quadric at x = y = 0 (do Carmo 1976, sections
/// 3-2 and 3-3).
/// @param which  neighbourhood; it has an extent
LocalFrame tangent_frame(const Quadrics& quadrics, const PrincipalAxes& axes, std::size_t which);

/// The plane of the principal axes, where no more is known of the surface than its mean curvature:
/// no direction is flatter than another.
/// @param curvature  > 0 where the surface bends towards PrincipalAxes::kNormal
LocalFrame tangent_frame(double curvature, const PrincipalAxes& axes, std::size_t which);

}  // namespace knap
