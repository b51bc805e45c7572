#include "curvature/fourier.hpp"

#include "curvature/sections.hpp"

namespace knap {

std::span<const double> FourierEstimator::mean_curvatures(const Neighbourhoods& neighbourhoods,
                                                          Work& work) const {
    constexpr std::size_t kSmallest = 4;
    work.curvatures.assign(neighbourhoods.count, 0);
    if (neighbourhoods.size >= kSmallest && series_.samples > 0) {
        find_principal_axes(neighbourhoods, work.axes);
        find_mean_curvatures(series_, neighbourhoods, work.axes, work.heights, work.curvatures);
    }
    return work.curvatures;
}

double FourierEstimator::mean_curvature(std::span<const Vec3> neighbourhood) const {
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
