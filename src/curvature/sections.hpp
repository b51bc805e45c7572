#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "curvature/fourier_series.hpp"
#include "curvature/neighbourhoods.hpp"
#include "curvature/principal_axes.hpp"

namespace knap {

/// Heights of surfaces at the samples along both axes of their frames, cloud units. Memory that is
/// used again from call to call.
struct SectionHeights {
    std::size_t stride = 0;  ///< values from one neighbourhood to the next
    std::vector<double> x;
    std::vector<double> y;

    /// Makes room, for a vector more than asked for; contents are undefined.
    void resize(std::size_t count, std::size_t samples);
};

/// H = (kappa_x + kappa_y) / 2 of each neighbourhood (method section 2): the surface's heights
/// at the samples along both axes, and the curvature of their series.
///
/// In each quadrant around a sample the nearest point counts; of equally near ones the lowest. So
/// the order of a neighbourhood's points does not matter. Which instructions are used makes no
/// difference to the result.
/// @param result  one value a neighbourhood, 1 / cloud unit, finite; > 0 where the surface bends
///                towards PrincipalAxes::kNormal; 0 without extent
void find_mean_curvatures(const FourierSeries& series, const Neighbourhoods& neighbourhoods,
                          const PrincipalAxes& axes, SectionHeights& heights,
                          std::span<double> result);

}  // namespace knap
