#include "curvature/fourier.hpp"

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>

namespace knap {

namespace {

/// A neighbourhood in its own frame: x and y along the surface, z along the normal.
// NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): to_local_frame fills the first `size`.
struct LocalFrame {
    std::size_t size = 0;
    std::array<double, kMostNeighbourhood> x;
    std::array<double, kMostNeighbourhood> y;
    std::array<double, kMostNeighbourhood> z;
};

// Eigenvectors of the covariance of all points about their centroid; origin at the first point.
// An eigenvector's sign is arbitrary, but the samples u_l reach one step farther to the negative
// side, so that it matters: axes are taken as Eigen's iterative solver returns them.
// False where the points have no extent.
bool to_local_frame(std::span<const Vec3> points, LocalFrame& local) {
    const std::size_t size = points.size();
    const auto count = static_cast<double>(size);
    local.size = size;
    std::array<Vec3, kMostNeighbourhood> from_origin;
    Vec3 centroid;
    for (std::size_t i = 0; i < size; ++i) {
        from_origin[i] = points[i] - points[0];
        centroid = centroid + from_origin[i];
    }
    centroid = {centroid.x / count, centroid.y / count, centroid.z / count};
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    double& xx = covariance(0, 0);
    double& yx = covariance(1, 0);
    double& yy = covariance(1, 1);
    double& zx = covariance(2, 0);
    double& zy = covariance(2, 1);
    double& zz = covariance(2, 2);
    for (std::size_t i = 0; i < size; ++i) {
        const Vec3 q = from_origin[i] - centroid;
        xx += q.x * q.x;
        yx += q.y * q.x;
        yy += q.y * q.y;
        zx += q.z * q.x;
        zy += q.z * q.y;
        zz += q.z * q.z;
    }
    // The solver reads the lower triangle only.
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
    if (solver.info() != Eigen::Success || !(solver.eigenvalues()[2] > 0)) {
        return false;
    }
    const Eigen::Matrix3d& axes = solver.eigenvectors();
    const auto along = [&](const Vec3& p, int axis) {
        return p.x * axes(0, axis) + p.y * axes(1, axis) + p.z * axes(2, axis);
    };
    for (std::size_t i = 0; i < size; ++i) {
        local.x[i] = along(from_origin[i], 2);
        local.y[i] = along(from_origin[i], 1);
        local.z[i] = along(from_origin[i], 0);
    }
    return true;
}

}  // namespace

double FourierEstimator::mean_curvature(std::span<const Vec3> neighbourhood) const {
    constexpr std::size_t kSmallest = 4;
    LocalFrame local;
    if (neighbourhood.size() < kSmallest || series_.samples == 0 ||
        !to_local_frame(neighbourhood, local)) {
        return 0;
    }
    const auto x = std::span(local.x).first(local.size);
    const auto y = std::span(local.y).first(local.size);
    const auto z = std::span(local.z).first(local.size);
    const double h = std::abs((series_.curvature(x, y, z) + series_.curvature(y, x, z)) / 2);
    return std::isfinite(h) ? h : 0;
}

}  // namespace knap
