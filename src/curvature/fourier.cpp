#include "curvature/fourier.hpp"

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>

#include "curvature/vectorised.hpp"

namespace knap {

namespace {

constexpr std::size_t kLanes = 8;
static_assert(kMostNeighbourhood % kLanes == 0);

/// Coordinates of a neighbourhood, axis by axis.
struct Coordinates {
    alignas(64) std::array<double, kMostNeighbourhood> x;
    alignas(64) std::array<double, kMostNeighbourhood> y;
    alignas(64) std::array<double, kMostNeighbourhood> z;
};

/// Sums over a neighbourhood: first and second moments about its first point.
struct Moments {
    double x, y, z, xx, yx, yy, zx, zy, zz;
};

// Eight sums side by side, added up in order at the end: the same on every machine.
class LaneSum {
  public:
    void add(std::size_t lane, double value) { sums_[lane] += value; }
    double total() const {
        return ((sums_[0] + sums_[4]) + (sums_[1] + sums_[5])) +
               ((sums_[2] + sums_[6]) + (sums_[3] + sums_[7]));
    }

  private:
    std::array<double, kLanes> sums_{};
};

// Points beyond `size` are zero up to a whole number of lanes, and add nothing.
KNAP_VECTORISED Moments moments_of(const Coordinates& at, std::size_t size) {
    LaneSum x, y, z, xx, yx, yy, zx, zy, zz;
    for (std::size_t first = 0; first < size; first += kLanes) {
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const double px = at.x[first + lane];
            const double py = at.y[first + lane];
            const double pz = at.z[first + lane];
            x.add(lane, px);
            y.add(lane, py);
            z.add(lane, pz);
            xx.add(lane, px * px);
            yx.add(lane, py * px);
            yy.add(lane, py * py);
            zx.add(lane, pz * px);
            zy.add(lane, pz * py);
            zz.add(lane, pz * pz);
        }
    }
    return {x.total(),  y.total(),  z.total(),  xx.total(), yx.total(),
            yy.total(), zx.total(), zy.total(), zz.total()};
}

KNAP_VECTORISED void rotate(const Coordinates& from, const Eigen::Matrix3d& axes, std::size_t size,
                            Coordinates& to) {
    for (std::size_t i = 0; i < size; ++i) {
        to.x[i] = from.x[i] * axes(0, 2) + from.y[i] * axes(1, 2) + from.z[i] * axes(2, 2);
        to.y[i] = from.x[i] * axes(0, 1) + from.y[i] * axes(1, 1) + from.z[i] * axes(2, 1);
        to.z[i] = from.x[i] * axes(0, 0) + from.y[i] * axes(1, 0) + from.z[i] * axes(2, 0);
    }
}

// Into the frame of the eigenvectors of the covariance of all points about their centroid; origin
// at the first point. An eigenvector's sign is arbitrary, but the samples u_l reach one step
// farther to the negative side, so that it matters: axes are taken as Eigen's iterative solver
// returns them. False where the points have no extent.
bool to_local_frame(std::span<const Vec3> points, Coordinates& local) {
    const std::size_t size = points.size();
    Coordinates offsets;
    for (std::size_t i = 0; i < size; ++i) {
        offsets.x[i] = points[i].x - points[0].x;
        offsets.y[i] = points[i].y - points[0].y;
        offsets.z[i] = points[i].z - points[0].z;
    }
    for (std::size_t i = size; i % kLanes != 0; ++i) {
        offsets.x[i] = offsets.y[i] = offsets.z[i] = 0;
    }
    const Moments m = moments_of(offsets, size);
    const auto n = static_cast<double>(size);
    // The solver reads the lower triangle only.
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    covariance(0, 0) = m.xx - m.x * m.x / n;
    covariance(1, 0) = m.yx - m.y * m.x / n;
    covariance(1, 1) = m.yy - m.y * m.y / n;
    covariance(2, 0) = m.zx - m.z * m.x / n;
    covariance(2, 1) = m.zy - m.z * m.y / n;
    covariance(2, 2) = m.zz - m.z * m.z / n;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
    if (solver.info() != Eigen::Success || !(solver.eigenvalues()[2] > 0)) {
        return false;
    }
    rotate(offsets, solver.eigenvectors(), size, local);
    return true;
}

}  // namespace

double FourierEstimator::mean_curvature(std::span<const Vec3> neighbourhood) const {
    constexpr std::size_t kSmallest = 4;
    Coordinates local;
    if (neighbourhood.size() < kSmallest || series_.samples == 0 ||
        !to_local_frame(neighbourhood, local)) {
        return 0;
    }
    const auto x = std::span(local.x).first(neighbourhood.size());
    const auto y = std::span(local.y).first(neighbourhood.size());
    const auto z = std::span(local.z).first(neighbourhood.size());
    const double h = std::abs((series_.curvature(x, y, z) + series_.curvature(y, x, z)) / 2);
    return std::isfinite(h) ? h : 0;
}

}  // namespace knap
