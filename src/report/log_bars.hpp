#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "report/curvature_histogram.hpp"

namespace knap {

/// Points by a quantity, in bars of equal width on a logarithmic scale: of all points and of the
/// kept ones.
struct LogBars {
    struct Bar {
        double from = 0;
        double to = 0;
        std::uint64_t all = 0;
        std::uint64_t kept = 0;
    };

    std::vector<Bar> bars;  ///< ascending; the first and the last hold what is beyond, too
    Bar outside;            ///< what has no place on the scale: 0 or infinite
};

/// Bars of a quantity that is a function of the curvature.
/// @param quantity     of a curvature |H|; >= 0, may be infinite
/// @param per_octave   bars in a factor of two, > 0
LogBars log_bars(const CurvatureScale& scale, const CurvatureHistogram& all,
                 const CurvatureHistogram& kept, const std::function<double(double)>& quantity,
                 int per_octave);

/// What a chart says beside its bars.
struct ChartText {
    std::string title;
    std::string quantity;  ///< of the axis, with its unit
};

/// The bars as an SVG element: shares of all points and of the kept ones, each of its own sum.
std::string format_chart(const LogBars& bars, const ChartText& text);

}  // namespace knap
