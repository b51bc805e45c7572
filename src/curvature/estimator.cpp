#include "curvature/estimator.hpp"

namespace knap {

std::span<const double> CurvatureEstimator::mean_curvatures(const Neighbourhoods& neighbourhoods,
                                                            Work& work) const {
    constexpr std::size_t kSmallest = 4;
    work.curvatures.assign(neighbourhoods.count, 0);
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
    return work.curvatures;
}

double CurvatureEstimator::mean_curvature(std::span<const Vec3> neighbourhood) const {
    Neighbourhoods alone;
    alone.resize(1, neighbourhood.size());
    for (std::size_t i = 0; i < neighbourhood.size(); ++i) {
        alone.x[i] = neighbourhood[i].x - neighbourhood[0].x;
        alone.y[i] = neighbourhood[i].y - neighbourhood[0].y;
        alone.z[i] = neighbourhood[i].z - neighbourhood[0].z;
    }
    Work work;
    return mean_curvatures(alone, work).front();
}

}  // namespace knap
