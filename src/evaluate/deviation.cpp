#include "evaluate/deviation.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace knap {

namespace {

constexpr int kLeadingBits = 1 + 11 + 10;  // sign, exponent, and ten of the mantissa
constexpr int kDropped = 64 - kLeadingBits;

std::size_t bin_of(double distance) {
    return static_cast<std::size_t>(std::bit_cast<std::uint64_t>(distance) >> kDropped);
}

// The upper end of a bin.
double value_of(std::size_t bin) {
    return std::bit_cast<double>((std::uint64_t{bin} + 1) << kDropped);
}

}  // namespace

// The sign is never set.
DeviationSum::DeviationSum() : histogram_(std::size_t{1} << (kLeadingBits - 1)) {}

void DeviationSum::add(const Surface::Nearest& nearest) {
    ++points_;
    sum_.add(nearest.distance);
    squares_.add(nearest.distance * nearest.distance);
    if (std::isfinite(nearest.to_plane)) {
        plane_squares_.add(nearest.to_plane * nearest.to_plane);
    }
    max_ = std::max(max_, nearest.distance);
    ++histogram_[bin_of(nearest.distance)];
}

void DeviationSum::add(const DeviationSum& other) {
    points_ += other.points_;
    sum_.add(other.sum_);
    squares_.add(other.squares_);
    plane_squares_.add(other.plane_squares_);
    max_ = std::max(max_, other.max_);
    for (std::size_t bin = 0; bin < histogram_.size(); ++bin) {
        histogram_[bin] += other.histogram_[bin];
    }
}

Deviation DeviationSum::result(double area) const {
    Deviation deviation;
    deviation.points = points_;
    deviation.facet_d = plane_squares_.value() / area;
    if (points_ == 0) {
        return deviation;
    }
    const auto n = static_cast<double>(points_);
    deviation.mean = sum_.value() / n;
    deviation.rms = std::sqrt(squares_.value() / n);
    deviation.max = max_;
    const std::uint64_t wanted = points_ - points_ / 100;
    std::uint64_t seen = 0;
    std::size_t bin = 0;
    while ((seen += histogram_[bin]) < wanted) {
        ++bin;
    }
    deviation.p99 = std::min(value_of(bin), max_);
    return deviation;
}

}  // namespace knap
