#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "report/curvature_histogram.hpp"
#include "report/splats.hpp"

namespace knap {

/// A surface as an eye sees it: what is nearest in each pixel.
struct Relief {
    static constexpr float kNothing = std::numeric_limits<float>::infinity();

    int width = 0;
    int height = 0;
    std::vector<float> depth;           ///< pixels; kNothing where there is no surface
    std::vector<std::uint16_t> code;    ///< of the curvature
    std::vector<std::uint32_t> facing;  ///< packed

    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(x);
    }
    bool is_empty(int x, int y) const { return depth[index(x, y)] == kNothing; }
};

/// The surface that splats make: small holes among them closed.
/// @param reach  pixels; a hole is closed where the surface goes on within so many in most
/// directions
/// @param gap    pixels; what lies farther than this behind is seen through a hole
Relief relief_of(const SplatBuffer& splats, int reach, float gap = Relief::kNothing);

/// Smooths a surface: each pixel gets the depth and the facing of the plane of least squares
/// through the pixels round it that lie on the same side of an edge, and the mean of their
/// curvatures.
/// @param reach  pixels to each side, >= 1
void smooth(Relief& relief, const CurvatureScale& scale, int reach);

/// Pixels by the code of their curvature.
CurvatureHistogram pixel_histogram(const Relief& relief);

}  // namespace knap
