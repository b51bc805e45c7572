#pragma once

#include <array>
#include <vector>

#include "curvature/neighbourhoods.hpp"

namespace knap {

/// Orthonormal axes, one frame a neighbourhood: the eigenvectors of the covariance of its points
/// about their centroid.
struct PrincipalAxes {
    enum Axis { kNormal, kSecond, kFirst };  ///< by ascending eigenvalue

    /// axes[axis][coordinate][i]: of neighbourhood i.
    std::array<std::array<std::vector<double>, 3>, 3> axes;
    std::vector<double> largest;  ///< absolute coordinate, cloud units; 0: no extent, and no axes
};

/// The frames of all neighbourhoods, many at a time.
///
/// Sums over a neighbourhood are exact, so that the order of its points does not matter:
/// coordinates are split into two whole numbers small enough that sums of their products have no
/// rounding. An eigenvector's sign is arbitrary, but the estimator's samples reach one step farther
/// to the negative side, so that it matters. It is that of tridiagonalisation by one reflection
/// and implicit QR steps with Wilkinson's shift (Golub and Van Loan, section 8.3), as Eigen's
/// SelfAdjointEigenSolver has it.
void find_principal_axes(const Neighbourhoods& neighbourhoods, PrincipalAxes& result);

}  // namespace knap
