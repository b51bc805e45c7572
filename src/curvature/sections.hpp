#pragma once

#include <span>

#include "curvature/fourier_series.hpp"
#include "curvature/neighbourhoods.hpp"
#include "curvature/principal_axes.hpp"

namespace knap {

/// |H| = |kappa_x + kappa_y| / 2 of each neighbourhood (method section 2): the surface's heights
/// at the samples along both axes, and the curvature of their series.
///
/// In each quadrant around a sample the nearest point counts; of equally near ones the lowest. So
/// the order of a neighbourhood's points does not matter. Which instructions are used makes no
/// difference to the result.
/// @param result  one value a neighbourhood, 1 / cloud unit, finite, >= 0; 0 without extent
void find_mean_curvatures(const FourierSeries& series, const Neighbourhoods& neighbourhoods,
                          const PrincipalAxes& axes, std::span<double> result);

}  // namespace knap
