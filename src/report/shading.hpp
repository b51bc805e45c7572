#pragma once

#include "report/colour_map.hpp"
#include "report/image.hpp"
#include "report/relief.hpp"

namespace knap {

/// What is behind the cloud.
inline constexpr Light kBackground{0.0125F, 0.0152F, 0.0198F};

/// A surface coloured by curvature, lit from the upper left, darker where something stands before
/// it (eye-dome lighting; source: Boucheny, 2009). Four pixels become one.
Image shade(const Relief& relief, const CurvatureColours& colours);

/// Points as dots over a dim surface.
/// @param dots  of the size of the relief; what is in front of them is not asked
Image shade_dots(const Relief& relief, const SplatBuffer& dots, const CurvatureColours& colours);

}  // namespace knap
