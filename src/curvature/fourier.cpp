#include "curvature/fourier.hpp"

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <numbers>

namespace knap {

namespace {

constexpr std::size_t kMaxSamples = 64;
constexpr std::size_t kMaxPoints = 256;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

template <std::size_t N>
using Lanes = std::array<double, N>;

/// A neighbourhood in its own frame: x and y along the surface, z along the normal.
struct LocalFrame {
    std::size_t size = 0;
    std::array<double, kMaxPoints> x;
    std::array<double, kMaxPoints> y;
    std::array<double, kMaxPoints> z;
};

// Eigenvectors of the covariance of all points about their centroid; origin at the first point.
// An eigenvector's sign is arbitrary, but the samples u_l reach one step farther to the negative
// side, so that it matters: axes are taken as Eigen's iterative solver returns them.
// False where the points have no extent.
bool to_local_frame(std::span<const Vec3> points, LocalFrame& local) {
    const Vec3 origin = points[0];
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
    for (const Vec3& p : points) {
        centroid += Eigen::Vector3d(p.x - origin.x, p.y - origin.y, p.z - origin.z);
    }
    centroid /= static_cast<double>(points.size());
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (const Vec3& p : points) {
        const Eigen::Vector3d q =
            Eigen::Vector3d(p.x - origin.x, p.y - origin.y, p.z - origin.z) - centroid;
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column <= row; ++column) {
                covariance(row, column) += q[row] * q[column];
            }
        }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
    if (solver.info() != Eigen::Success || !(solver.eigenvalues()[2] > 0)) {
        return false;
    }
    const Eigen::Vector3d ez = solver.eigenvectors().col(0);
    const Eigen::Vector3d ey = solver.eigenvectors().col(1);
    const Eigen::Vector3d ex = solver.eigenvectors().col(2);
    local.size = points.size();
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double dx = points[i].x - origin.x;
        const double dy = points[i].y - origin.y;
        const double dz = points[i].z - origin.z;
        local.x[i] = dx * ex[0] + dy * ex[1] + dz * ex[2];
        local.y[i] = dx * ey[0] + dy * ey[1] + dz * ey[2];
        local.z[i] = dx * ez[0] + dy * ez[1] + dz * ez[2];
    }
    return true;
}

// The nearest point to each sample in the two quadrants on one side of the axis. Ties go to the
// earlier point. A quadrant without a point stays infinitely far with z = 0.
template <std::size_t N>
struct HalfPlane {
    Lanes<N> ahead;
    Lanes<N> ahead_z;
    Lanes<N> behind;
    Lanes<N> behind_z;

    explicit HalfPlane(std::size_t n) {
        for (std::size_t l = 0; l < n; ++l) {
            ahead[l] = behind[l] = kInfinity;
            ahead_z[l] = behind_z[l] = 0;
        }
    }

    void offer(double along, double off_squared, double z, const Lanes<kMaxSamples>& u, std::size_t n) {
        for (std::size_t l = 0; l < n; ++l) {
            const double d = along - u[l];
            const double squared = d * d + off_squared;
            const double to_ahead = d >= 0 ? squared : kInfinity;
            const double to_behind = d >= 0 ? kInfinity : squared;
            ahead_z[l] = to_ahead < ahead[l] ? z : ahead_z[l];
            ahead[l] = to_ahead < ahead[l] ? to_ahead : ahead[l];
            behind_z[l] = to_behind < behind[l] ? z : behind_z[l];
            behind[l] = to_behind < behind[l] ? to_behind : behind[l];
        }
    }
};

}  // namespace

/// The transform is linear in the samples, so it folds into two weights a sample.
struct FourierEstimator::Weights {
    std::size_t samples = 0;
    Lanes<kMaxSamples> u{};       ///< sample positions, cloud units
    Lanes<kMaxSamples> first{};   ///< f'(0)  = sum first[l] g[l]
    Lanes<kMaxSamples> second{};  ///< f''(0) = sum second[l] g[l]

    /// kappa along one axis; N lanes, of which `samples` are in use.
    template <std::size_t N>
    double curvature_along(std::size_t size, const double* along, const double* across,
                           const double* z) const;
};

template <std::size_t N>
double FourierEstimator::Weights::curvature_along(std::size_t size, const double* along,
                                                  const double* across, const double* z) const {
    // With N = 8 (the default) the trip count is a constant and the lanes stay in registers.
    const std::size_t n = N == kMaxSamples ? samples : N;
    HalfPlane<N> left(n);
    HalfPlane<N> right(n);
    for (std::size_t i = 0; i < size; ++i) {
        HalfPlane<N>& side = across[i] >= 0 ? left : right;
        side.offer(along[i], across[i] * across[i] + z[i] * z[i], z[i], u, n);
    }
    Lanes<N> weighted;
    Lanes<N> total;
    for (std::size_t l = 0; l < n; ++l) {
        weighted[l] = total[l] = 0;
    }
    const auto add = [&](const Lanes<N>& squared, const Lanes<N>& height) {
        for (std::size_t l = 0; l < n; ++l) {
            const double inverse = 1 / std::sqrt(squared[l]);
            weighted[l] += height[l] * inverse;
            total[l] += inverse;
        }
    };
    add(left.ahead, left.ahead_z);
    add(left.behind, left.behind_z);
    add(right.ahead, right.ahead_z);
    add(right.behind, right.behind_z);
    double slope = 0;
    double bend = 0;
    for (std::size_t l = 0; l < n; ++l) {
        double g = weighted[l] / total[l];
        // A point at distance 0 gives its z.
        g = left.ahead[l] == 0 ? left.ahead_z[l] : right.ahead[l] == 0 ? right.ahead_z[l] : g;
        slope += first[l] * g;
        bend += second[l] * g;
    }
    const double steepness = 1 + slope * slope;
    return bend / (steepness * std::sqrt(steepness));
}

FourierEstimator::FourierEstimator(const CurvatureParams& params, double spacing)
    : weights_(std::make_unique<Weights>()) {
    const int samples = params.samples;
    const double h = params.step * spacing;
    if (!(h > 0)) {
        return;
    }
    weights_->samples = static_cast<std::size_t>(samples);
    const double base = std::numbers::pi / (samples * h / 2);
    for (int l = 0; l < samples; ++l) {
        const int place = l - samples / 2;
        double first = 0;
        double second = 0;
        for (int n = 1; n < samples / 2; ++n) {
            const double angle = 2 * std::numbers::pi * n * place / samples;
            first += n * std::sin(angle);
            second += n * n * std::cos(angle);
        }
        const auto lane = static_cast<std::size_t>(l);
        weights_->u[lane] = place * h;
        weights_->first[lane] = base * 2 / samples * first;
        weights_->second[lane] = -base * base * 2 / samples * second;
    }
}

FourierEstimator::~FourierEstimator() = default;
FourierEstimator::FourierEstimator(FourierEstimator&&) noexcept = default;

double FourierEstimator::mean_curvature(std::span<const Vec3> neighbourhood) const {
    constexpr std::size_t kSmallest = 4;
    if (neighbourhood.size() < kSmallest || weights_->samples == 0) {
        return 0;
    }
    LocalFrame local;
    if (!to_local_frame(neighbourhood, local)) {
        return 0;
    }
    const auto along_both = [&](auto lanes) {
        constexpr std::size_t kLanes = decltype(lanes)::value;
        const double kx = weights_->curvature_along<kLanes>(local.size, local.x.data(),
                                                            local.y.data(), local.z.data());
        const double ky = weights_->curvature_along<kLanes>(local.size, local.y.data(),
                                                            local.x.data(), local.z.data());
        return std::abs((kx + ky) / 2);
    };
    constexpr std::size_t kDefaultSamples = 8;
    const double h = weights_->samples == kDefaultSamples
                         ? along_both(std::integral_constant<std::size_t, kDefaultSamples>{})
                         : along_both(std::integral_constant<std::size_t, kMaxSamples>{});
    return std::isfinite(h) ? h : 0;
}

}  // namespace knap
