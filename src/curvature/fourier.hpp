#pragma once

#include <span>

#include "curvature/fourier_series.hpp"
#include "knap/geometry.hpp"
#include "knap/params.hpp"

namespace knap {

/// Mean curvature by a truncated Fourier series along the two principal axes of a neighbourhood.
/// Source: Altantsetseg et al. 2013; Yang et al. 2015, section 3; the gaps as in docs/method.md.
class FourierEstimator {
  public:
    /// @param params   valid
    /// @param spacing  mean nearest-neighbour distance of the whole archive, cloud units, >= 0;
    ///                 0 (no two points) makes every curvature 0
    FourierEstimator(const CurvatureParams& params, double spacing) : series_(params, spacing) {}

    /// |H| at the first point of a neighbourhood, 1 / cloud unit. Thread-safe.
    /// @param neighbourhood  the point itself, then its neighbours by (distance, id); at most 256
    /// @return               finite, >= 0; 0 for fewer than 4 points or without extent
    double mean_curvature(std::span<const Vec3> neighbourhood) const;

  private:
    FourierSeries series_;
};

}  // namespace knap
