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
#include "store/local_frame.hpp"

namespace knap {

/// Mean curvature from a neighbourhood in the frame of its principal axes: by a truncated Fourier
/// series along two of them (Altantsetseg et al. 2013; Yang et al. 2015, section 3; the gaps as in
/// docs/method.md), or by a quadric fitted to it.
class CurvatureEstimator {
  public:
    /// @param params   valid
    /// @param spacing  mean nearest-neighbour distance of the whole archive, cloud units, >= 0;
    ///                 0 (no two points) makes every curvature 0
    /// @param frames   find the surface's frame at each point too
    CurvatureEstimator(const CurvatureParams& params, double spacing, bool frames = false)
        : estimator_(params.estimator),
          discount_noise_(params.discount_noise),
          frames_(frames),
          series_(params, spacing) {}

    /// What a neighbourhood says of its point.
    struct Estimate {
        double curvature = 0;  ///< |H|, 1 / cloud unit
        PackedFrame frame{};   ///< none where none was asked for, or the point has no surface
    };

    bool finds_frames() const { return frames_; }

    /// Memory that is used again from call to call.
    struct Work {
        PrincipalAxes axes;
        SectionHeights heights;
        Quadrics quadrics;
        std::vector<double> curvatures;
        std::vector<PackedFrame> frames;
    };

    /// |H| at the centres of neighbourhoods, 1 / cloud unit: finite, >= 0; 0 where a neighbourhood
    /// has fewer than 4 points or no extent; less for points off their surface, if the parameters
    /// say so. Each depends on the set of its points only.
    /// Thread-safe.
    /// @return  in `work`, whose `frames` are those of the same points, if they were asked for
    std::span<const double> mean_curvatures(const Neighbourhoods& neighbourhoods, Work& work) const;

    /// The same at the first point of one neighbourhood.
    /// @param neighbourhood  the point itself, then the others; at most 256
    Estimate estimate(std::span<const Vec3> neighbourhood) const;
    double mean_curvature(std::span<const Vec3> neighbourhood) const {
        return estimate(neighbourhood).curvature;
    }

  private:
    void find_frames(std::size_t count, Work& work) const;

    Estimator estimator_;
    bool discount_noise_;
    bool frames_;
    FourierSeries series_;
};

}  // namespace knap
