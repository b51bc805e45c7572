#include "report/curvature_histogram.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace knap {

std::uint32_t CurvatureScale::code_of(double curvature) const {
    if (!(curvature > 0) || !(mean_ > 0)) {
        return 0;
    }
    const double octaves = std::log2(curvature / mean_);
    const double code = std::floor(octaves * kPerOctave) + kCodes / 2.0;
    return static_cast<std::uint32_t>(std::clamp(code, 0.0, kCodes - 1.0));
}

double CurvatureScale::curvature_of(std::uint32_t code) const {
    return code == 0 ? 0 : mean_ * std::exp2((code + 0.5 - kCodes / 2.0) / kPerOctave);
}

void CurvatureHistogram::add(const CurvatureHistogram& other) {
    for (std::size_t i = 0; i < counts_.size(); ++i) {
        counts_[i] += other.counts_[i];
    }
}

std::uint64_t CurvatureHistogram::points() const {
    return std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0});
}

std::uint32_t CurvatureHistogram::quantile(double share) const {
    const std::uint64_t all = points() - counts_[0];
    if (all == 0) {
        return 0;
    }
    const auto rank = static_cast<std::uint64_t>(share * static_cast<double>(all - 1));
    std::uint64_t before = 0;
    for (std::uint32_t code = 1; code < counts_.size(); ++code) {
        before += counts_[code];
        if (before > rank) {
            return code;
        }
    }
    return static_cast<std::uint32_t>(counts_.size() - 1);
}

}  // namespace knap
