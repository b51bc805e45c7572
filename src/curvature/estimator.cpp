#include "curvature/estimator.hpp"

#include <cmath>

#include "curvature/tangent_frame.hpp"

namespace knap {

std::span<const double> CurvatureEstimator::mean_curvatures(const Neighbourhoods& neighbourhoods,
                                                            Work& work) const {
    constexpr std::size_t kSmallest = 4;
    work.curvatures.assign(neighbourhoods.count, 0);
    work.frames.assign(frames_ ? neighbourhoods.count : 0, PackedFrame());
    if (neighbourhoods.size < kSmallest || series_.samples == 0) {
        return work.curvatures;
    }
    find_principal_axes(neighbourhoods, work.axes);
    switch (estimator_) {
        case Estimator::kFourier:
            find_mean_curvatures(series_, neighbourhoods, work.axes, work.heights, work.curvatures);
            break;
        case Estimator::kQuadric:
            fit_quadrics(neighbourhoods, work.axes, work.quadrics);
            mean_curvatures_of(work.quadrics, work.axes, discount_noise_, work.curvatures);
            break;
    }
    if (frames_) {
        find_frames(neighbourhoods.count, work);
    }
    for (double& curvature : work.curvatures) {
        curvature = std::abs(curvature);
    }
    return work.curvatures;
}

void CurvatureEstimator::find_frames(std::size_t count, Work& work) const {
    for (std::size_t i = 0; i < count; ++i) {
        if (!(work.axes.largest[i] > 0)) {
            continue;
        }
        work.frames[i] = PackedFrame(estimator_ == Estimator::kQuadric
                                         ? tangent_frame(work.quadrics, work.axes, i)
                                         : tangent_frame(work.curvatures[i], work.axes, i));
    }
}

CurvatureEstimator::Estimate CurvatureEstimator::estimate(
    std::span<const Vec3> neighbourhood) const {
    Neighbourhoods alone;
    alone.resize(1, neighbourhood.size());
    for (std::size_t i = 0; i < neighbourhood.size(); ++i) {
        alone.x[i] = neighbourhood[i].x - neighbourhood[0].x;
        alone.y[i] = neighbourhood[i].y - neighbourhood[0].y;
        alone.z[i] = neighbourhood[i].z - neighbourhood[0].z;
    }
    Work work;
    const double curvature = mean_curvatures(alone, work).front();
    return {curvature, frames_ ? work.frames.front() : PackedFrame()};
}

}  // namespace knap
