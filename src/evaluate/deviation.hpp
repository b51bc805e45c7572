#pragma once

#include <cstdint>
#include <vector>

#include "base/exact_sum.hpp"
#include "surface/surface.hpp"

namespace knap {

/// How far original points are from a surface (Yang et al. 2015, equations 1 and 2, and what is
/// usual); lengths in cloud units.
struct Deviation {
    std::uint64_t points = 0;  ///< finite ones
    double mean = 0;
    double rms = 0;
    double p99 = 0;  ///< 99 % of the points are no farther; up to 0.1 % too large
    double max = 0;
    /// The paper's D: the mean square distance to the planes of the nearest facets, as a sum over
    /// points divided by the area of the facets; NaN where the surface has none.
    double facet_d = 0;
};

/// Adds up a Deviation. The order of points makes no difference.
class DeviationSum {
  public:
    DeviationSum();

    void add(const Surface::Nearest& nearest);
    void add(const DeviationSum& other);

    /// @param area  of the surface, cloud units squared
    Deviation result(double area) const;

  private:
    std::uint64_t points_ = 0;
    ExactSum sum_;
    ExactSum squares_;
    ExactSum plane_squares_;
    double max_ = 0;
    // Distances by their leading bits: steps of a thousandth.
    std::vector<std::uint64_t> histogram_;
};

}  // namespace knap
