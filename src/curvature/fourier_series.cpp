#include "curvature/fourier_series.hpp"

#include <cmath>
#include <numbers>

namespace knap {

FourierSeries::FourierSeries(const CurvatureParams& params, double spacing) {
    const double h = params.step * spacing;
    if (!(h > 0)) {
        return;
    }
    samples = static_cast<std::size_t>(params.samples);
    const double base = std::numbers::pi / (params.samples * h / 2);
    for (int l = 0; l < params.samples; ++l) {
        const int place = l - params.samples / 2;
        double sines = 0;
        double cosines = 0;
        for (int n = 1; n < params.samples / 2; ++n) {
            const double angle = 2 * std::numbers::pi * n * place / params.samples;
            sines += n * std::sin(angle);
            cosines += n * n * std::cos(angle);
        }
        const auto lane = static_cast<std::size_t>(l);
        u[lane] = place * h;
        first[lane] = base * 2 / params.samples * sines;
        second[lane] = -base * base * 2 / params.samples * cosines;
    }
}

}  // namespace knap
