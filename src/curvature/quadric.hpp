#pragma once

#include <array>
#include <span>
#include <vector>

#include "curvature/neighbourhoods.hpp"
#include "curvature/principal_axes.hpp"

namespace knap {

/// Surfaces z = a x^2 + b xy + c y^2 + d x + e y + f in the frames of neighbourhoods, x along
/// PrincipalAxes::kFirst, y along kSecond, z along kNormal, the origin at the point.
struct Quadrics {
    enum Coefficient { kXX, kXY, kYY, kX, kY, kOne };
    static constexpr std::size_t kCoefficients = 6;

    std::array<std::vector<double>, kCoefficients> of;  ///< of[coefficient][i]: of neighbourhood i
    /// Standard deviation of the points' heights from the quadric, cloud units, >= 0.
    std::vector<double> deviations;

    /// Makes room, for a vector more than asked for; contents are undefined.
    void resize(std::size_t count);
};

/// Fits a quadric to each neighbourhood by least squares of the heights.
///
/// Sums over a neighbourhood are exact, of terms rounded to 2^-44 of the largest, so that the order
/// of its points does not matter. A coefficient that the points and those before it, in the order
/// f, d, e, a, b, c, do not leave open is 0: those of y where all points are on a line. Which
/// instructions are used makes no difference to the result.
void fit_quadrics(const Neighbourhoods& neighbourhoods, const PrincipalAxes& axes,
                  Quadrics& result);

/// The mean curvature of a quadric at x = y = 0 (do Carmo 1976, section 3-3):
///
///     H = ((1 + e^2) 2a - 2 d e b + (1 + d^2) 2c) / (2 (1 + d^2 + e^2)^(3/2))
///
/// @param discounted  divide it by 1 + (t - 1/2)^2, where the point lies t standard deviations off
///                    the quadric, on the convex side if t > 0: of points on one noisy surface,
///                    those come first that lie on it, or slightly outside, as chords cut inside
/// @param result      one value a neighbourhood, 1 / cloud unit, finite; > 0 where the quadric
/// bends
///                    towards PrincipalAxes::kNormal; 0 without extent
void mean_curvatures_of(const Quadrics& quadrics, const PrincipalAxes& axes, bool discounted,
                        std::span<double> result);

}  // namespace knap
