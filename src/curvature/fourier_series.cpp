#include "curvature/fourier_series.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "curvature/vectorised.hpp"

namespace knap {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kDefaultSamples = 8;

template <std::size_t N>
using Lanes = std::array<double, N>;

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

    void offer(double along, double off_squared, double z, const Lanes<kMostSamples>& u,
               std::size_t n) {
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

// The points on one side of the axis.
struct Side {
    std::size_t size = 0;
    std::array<double, kMostNeighbourhood> along;
    std::array<double, kMostNeighbourhood> off_squared;
    std::array<double, kMostNeighbourhood> z;
};

// Writes every point to both sides and moves on where it belongs: no branch to guess.
void split(std::span<const double> along, std::span<const double> across, std::span<const double> z,
           Side& left, Side& right) {
    for (std::size_t i = 0; i < along.size(); ++i) {
        const double off_squared = across[i] * across[i] + z[i] * z[i];
        for (Side* side : {&left, &right}) {
            side->along[side->size] = along[i];
            side->off_squared[side->size] = off_squared;
            side->z[side->size] = z[i];
        }
        const std::size_t is_left = across[i] >= 0 ? 1 : 0;
        left.size += is_left;
        right.size += 1 - is_left;
    }
}

// One lane a sample. N lanes, of which series.samples are in use; with the default number of
// samples the loops have constant lengths and the lanes stay in registers.
template <std::size_t N>
double curvature_in_lanes(const FourierSeries& series, const Side& left_points,
                          const Side& right_points) {
    const std::size_t n = N == kDefaultSamples ? N : series.samples;
    HalfPlane<N> left(n);
    HalfPlane<N> right(n);
    for (std::size_t i = 0; i < left_points.size; ++i) {
        left.offer(left_points.along[i], left_points.off_squared[i], left_points.z[i], series.u, n);
    }
    for (std::size_t i = 0; i < right_points.size; ++i) {
        right.offer(right_points.along[i], right_points.off_squared[i], right_points.z[i], series.u,
                    n);
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
        slope += series.first[l] * g;
        bend += series.second[l] * g;
    }
    const double steepness = 1 + slope * slope;
    return bend / (steepness * std::sqrt(steepness));
}

KNAP_VECTORISED double curvature_of_default(const FourierSeries& series, const Side& left,
                                            const Side& right) {
    return curvature_in_lanes<kDefaultSamples>(series, left, right);
}

}  // namespace

FourierSeries::FourierSeries(const CurvatureParams& params, double spacing) {
    const double h = params.step * spacing;
    if (!(h > 0)) {
        return;
    }
    samples = static_cast<std::size_t>(params.samples);
    const double base = std::numbers::pi / (params.samples * h / 2);
    for (int l = 0; l < params.samples; ++l) {
        const int place = l - params.samples / 2;
        double sines = 0;
        double cosines = 0;
        for (int n = 1; n < params.samples / 2; ++n) {
            const double angle = 2 * std::numbers::pi * n * place / params.samples;
            sines += n * std::sin(angle);
            cosines += n * n * std::cos(angle);
        }
        const auto lane = static_cast<std::size_t>(l);
        u[lane] = place * h;
        first[lane] = base * 2 / params.samples * sines;
        second[lane] = -base * base * 2 / params.samples * cosines;
    }
}

double FourierSeries::curvature(std::span<const double> along, std::span<const double> across,
                                std::span<const double> z) const {
    Side left;
    Side right;
    split(along, across, z, left, right);
    return samples == kDefaultSamples ? curvature_of_default(*this, left, right)
                                      : curvature_in_lanes<kMostSamples>(*this, left, right);
}

}  // namespace knap
