#pragma once

#include <cstdint>

#include "report/curvature_histogram.hpp"
#include "report/image.hpp"

namespace knap {

/// Colours without light or shade, as amounts of light, 0 to 1.
struct Light {
    float red = 0;
    float green = 0;
    float blue = 0;
};

/// The colour as a screen wants it.
Colour to_screen(const Light& light);

/// A colour map from pale stone to deep red whose lightness falls evenly to the eye (OKLab).
/// @param place  [0, 1]
Light map_colour(double place);

/// The colours of curvatures: logarithmic between two quantiles, the same beyond.
struct CurvatureColours {
    static constexpr double kLowShare = 0.05;
    static constexpr double kHighShare = 0.99;

    std::uint32_t low = 0;  ///< codes, low <= high
    std::uint32_t high = 0;

    static CurvatureColours of(const CurvatureHistogram& histogram);

    /// Where a code is on the map, [0, 1].
    double place_of(std::uint32_t code) const;
};

}  // namespace knap
