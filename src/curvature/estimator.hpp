#pragma once

#include <span>
#include <vector>

#include "curvature/fourier_series.hpp"
#include "curvature/neighbourhoods.hpp"
#include "curvature/principal_axes.hpp"
#include "curvature/quadric.hpp"
#include "curvature/sections.hpp"
#include "knap/geometry.hpp"
#include "knap/params.hpp"

namespace knap {

/// Mean curvature from a neighbourhood in the frame of its principal axes: by a truncated Fourier
/// series along two of them (Altantsetseg et al. 2013; Yang et al. 2015, section 3; the gaps as in
/// docs/method.md), or by a quadric fitted to it.
class CurvatureEstimator {
  public:
    /// @param params   valid
    /// @param spacing  mean nearest-neighbour distance of the whole archive, cloud units, >= 0;
    ///                 0 (no two points) makes every curvature 0
    CurvatureEstimator(const CurvatureParams& params, double spacing)
        : estimator_(params.estimator),
          discount_noise_(params.discount_noise),
          series_(params, spacing) {}

    /// Memory that is used again from call to call.
    struct Work {
        PrincipalAxes axes;
        SectionHeights heights;
        Quadrics quadrics;
        std::vector<double> curvatures;
    };

    /// |H| at the centres of neighbourhoods, 1 / cloud unit: finite, >= 0; 0 where a neighbourhood
    /// has fewer than 4 points or no extent; less for points off their surface, if the parameters
    /// say so. Each depends on the set of its points only.
    /// Thread-safe.
    /// @return  in `work`
    std::span<const double> mean_curvatures(const Neighbourhoods& neighbourhoods, Work& work) const;

    /// The same at the first point of one neighbourhood.
    /// @param neighbourhood  the point itself, then the others; at most 256
    double mean_curvature(std::span<const Vec3> neighbourhood) const;

  private:
    Estimator estimator_;
    bool discount_noise_;
    FourierSeries series_;
};

}  // namespace knap
