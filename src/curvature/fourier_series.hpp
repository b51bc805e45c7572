#pragma once

#include <array>
#include <cstddef>

#include "knap/params.hpp"

namespace knap {

/// Most samples along an axis.
constexpr std::size_t kMostSamples = 64;

/// The truncated Fourier series of the surface's section along one axis. The transform is linear in
/// the samples, so that it folds into two weights a sample.
struct FourierSeries {
    std::size_t samples = 0;
    std::array<double, kMostSamples> u{};       ///< sample positions, cloud units
    std::array<double, kMostSamples> first{};   ///< f'(0)  = sum first[l] g[l]
    std::array<double, kMostSamples> second{};  ///< f''(0) = sum second[l] g[l]

    /// @param params   valid
    /// @param spacing  mean nearest-neighbour distance, cloud units, >= 0; 0 leaves no samples
    FourierSeries(const CurvatureParams& params, double spacing);
};

}  // namespace knap
