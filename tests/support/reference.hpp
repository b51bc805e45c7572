#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "knap/geometry.hpp"
#include "knap/params.hpp"

/// The method in memory by brute force, O(n^2), straight from docs/method.md. It shares no search,
/// order, sum or marking with the library; what it does share is said at each function.
namespace knap::reference {

struct Result {
    std::vector<PointId> kept;  ///< ascending
    std::uint64_t merged = 0;
    std::uint64_t rejected = 0;
    std::uint64_t represented = 0;
    double spacing = 0;
    double mean_curvature = 0;
};

/// Sections 1 to 6. The number |H| of one neighbourhood and its frame come from the library's
/// estimator, so that both sides order by the same bits; curvature() below is what that one is
/// tested against. Distances come from one FanSurface through all kept points.
Result simplify(std::span<const Vec3> points, const CurvatureParams& curvature,
                const RangeParams& range);

/// Section 2 written down literally: covariance, eigenvectors, quadrants, cosine and sine sums,
/// derivatives. Agrees with the library but for rounding.
/// @param neighbourhood  the point, then its neighbours
double curvature(std::span<const Vec3> neighbourhood, const CurvatureParams& params,
                 double spacing);

/// Sum of doubles, correctly rounded (Shewchuk's partial sums).
double exact_sum(std::span<const double> values);

}  // namespace knap::reference
