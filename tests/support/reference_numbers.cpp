#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "support/reference.hpp"

namespace knap::reference {

double curvature(std::span<const Vec3> neighbourhood, const CurvatureParams& params,
                 double spacing) {
    const auto n = static_cast<Eigen::Index>(neighbourhood.size());
    Eigen::MatrixXd points(n, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
        const Vec3& p = neighbourhood[static_cast<std::size_t>(i)];
        points.row(i) << p.x, p.y, p.z;
    }
    const Eigen::MatrixXd centred = points.rowwise() - points.colwise().mean();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(centred.transpose() * centred);
    const Eigen::Matrix3d frame = solver.eigenvectors();  // columns z, y, x
    const Eigen::MatrixXd local = (points.rowwise() - points.row(0)) * frame;

    const int samples = params.samples;
    const double h = params.step * spacing;
    const double half_period = samples * h / 2;
    const auto kappa = [&](int along, int across) {
        std::vector<double> g;
        for (int l = 0; l < samples; ++l) {
            const double u = (l - samples / 2) * h;
            std::array<double, 4> best;
            best.fill(std::numeric_limits<double>::infinity());
            std::array<double, 4> height{};
            for (Eigen::Index i = 0; i < n; ++i) {
                const double a = local(i, along);
                const double b = local(i, across);
                const double z = local(i, 0);
                const std::size_t quadrant = (a >= u ? 1U : 0U) + (b >= 0 ? 2U : 0U);
                const double distance = std::sqrt((a - u) * (a - u) + b * b + z * z);
                if (distance < best[quadrant]) {
                    best[quadrant] = distance;
                    height[quadrant] = z;
                }
            }
            double weighted = 0;
            double total = 0;
            bool exact = false;
            for (std::size_t q = 0; q < 4 && !exact; ++q) {
                if (best[q] == 0) {
                    weighted = height[q];
                    total = 1;
                    exact = true;
                } else if (std::isfinite(best[q])) {
                    weighted += height[q] / best[q];
                    total += 1 / best[q];
                }
            }
            g.push_back(weighted / total);
        }
        double first = 0;
        double second = 0;
        for (int order = 1; order < samples / 2; ++order) {
            double a = 0;
            double b = 0;
            for (int l = 0; l < samples; ++l) {
                const double angle = 2 * std::numbers::pi * order * (l - samples / 2) / samples;
                a += 2.0 / samples * g[static_cast<std::size_t>(l)] * std::cos(angle);
                b += 2.0 / samples * g[static_cast<std::size_t>(l)] * std::sin(angle);
            }
            first += std::numbers::pi / half_period * order * b;
            second -= std::pow(std::numbers::pi / half_period, 2) * order * order * a;
        }
        return second / std::pow(1 + first * first, 1.5);
    };
    return std::abs((kappa(2, 1) + kappa(1, 2)) / 2);
}

double exact_sum(std::span<const double> values) {
    // Partial sums that do not overlap, smallest first.
    std::vector<double> partials;
    for (double x : values) {
        std::size_t used = 0;
        for (double y : partials) {
            if (std::abs(x) < std::abs(y)) {
                std::swap(x, y);
            }
            const double high = x + y;
            const double low = y - (high - x);
            if (low != 0) {
                partials[used++] = low;
            }
            x = high;
        }
        partials.resize(used);
        partials.push_back(x);
    }
    if (partials.empty()) {
        return 0;
    }
    double sum = partials.back();
    partials.pop_back();
    double low = 0;
    while (!partials.empty()) {
        const double x = sum;
        const double y = partials.back();
        partials.pop_back();
        sum = x + y;
        low = y - (sum - x);
        if (low != 0) {
            break;
        }
    }
    // A tie that the partials below decide.
    if (!partials.empty() &&
        ((low < 0 && partials.back() < 0) || (low > 0 && partials.back() > 0))) {
        const double twice = low * 2;
        const double up = sum + twice;
        if (up - sum == twice) {
            sum = up;
        }
    }
    return sum;
}

}  // namespace knap::reference
