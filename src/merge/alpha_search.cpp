#include "merge/alpha_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/checksum.hpp"
#include "merge/range_law.hpp"
#include "merge/settle.hpp"

namespace knap {

namespace {

// A sample of fewer points is off by more than merges of all points set right.
constexpr double kFewestPoints = 1 << 17;
constexpr double kMostPoints = 1 << 20;
constexpr double kShare = 1.0 / 8;
// Side of a cell in mean spacings: many ranges wide, so that few of its points are near its faces.
constexpr double kCellSpacings = 64;
// Steps of the search in the sample, and merges of all points, at most.
constexpr int kMostSteps = 24;
constexpr int kMostTries = 6;

std::int64_t cell_index(double coordinate, double cells_per_unit) {
    return static_cast<std::int64_t>(std::floor(coordinate * cells_per_unit));
}

}  // namespace

SampleCells::SampleCells(std::uint64_t points, double spacing) {
    const auto n = static_cast<double>(points);
    const double share = std::clamp(n * kShare, kFewestPoints, kMostPoints) / n;
    if (!(share < 1) || !(spacing > 0)) {
        return;
    }
    int exponent = 0;
    std::frexp(spacing * kCellSpacings, &exponent);
    // Coarse enough that indices stay whole numbers wherever the cloud lies.
    constexpr int kSmallestExponent = -1000;
    cells_per_unit_ = std::ldexp(1.0, -std::max(exponent, kSmallestExponent));
    most_hash_ =
        static_cast<std::uint64_t>(share * static_cast<double>(std::uint64_t{1} << 63)) * 2;
}

bool SampleCells::contains(const Vec3& p) const {
    if (cells_per_unit_ == 0) {
        return true;
    }
    std::uint64_t hash = 0;
    for (int axis = 0; axis < 3; ++axis) {
        hash = splitmix64(hash ^ static_cast<std::uint64_t>(cell_index(p[axis], cells_per_unit_)));
    }
    return hash <= most_hash_;
}

std::uint64_t wanted_points(const RangeParams& range, std::uint64_t points) {
    if (range.ratio > 0) {
        return static_cast<std::uint64_t>(
            std::max(1.0, std::round(range.ratio * static_cast<double>(points))));
    }
    return range.count;
}

AlphaSearch::AlphaSearch(const AlphaGoal& goal, std::vector<RankedPoint> sample)
    : goal_(goal), sample_(std::move(sample)) {
    // As if each kept point had a square for itself; most are flatter than the mean, and so have
    // larger ranges than alpha.
    constexpr double kUsualFactor = 2;
    const double share = static_cast<double>(goal.points) /
                         static_cast<double>(std::max<std::uint64_t>(goal.wanted, 1));
    last_ = std::log(kUsualFactor * std::max(goal.spacing, std::numeric_limits<double>::min()) *
                     std::sqrt(std::max(share, 1.0)));
}

double AlphaSearch::next() {
    ++tries_;
    if (goal_.wanted >= goal_.points || sample_.empty() || goal_.spacing <= 0) {
        // Ranges so small that they hold no other point.
        last_ = std::log(std::max(goal_.spacing, 1.0)) - 40;
    } else {
        const double share =
            static_cast<double>(sample_.size()) / static_cast<double>(goal_.points);
        last_ = solve(static_cast<double>(goal_.wanted) * share / bias_);
    }
    return std::exp(last_);
}

bool AlphaSearch::told(std::uint64_t kept) {
    const double ratio = static_cast<double>(kept) / static_cast<double>(goal_.wanted);
    if (std::abs(ratio - 1) <= kTolerance || tries_ >= kMostTries || sample_.empty() ||
        goal_.wanted >= goal_.points) {
        return true;
    }
    const double share = static_cast<double>(sample_.size()) / static_cast<double>(goal_.points);
    const double before = bias_;
    bias_ = static_cast<double>(kept) * share / count(last_);
    // Another alpha would be the same one again.
    return bias_ == before;
}

double AlphaSearch::count(double log_alpha) {
    const auto known = counts_.find(log_alpha);
    if (known != counts_.end()) {
        return known->second;
    }
    RangeParams range = goal_.range;
    range.alpha = std::exp(log_alpha);
    const std::vector<Fate> fates =
        settle(sample_, RangeLaw(range, goal_.mean_curvature), std::span<const Box>());
    const auto kept = static_cast<double>(std::count(fates.begin(), fates.end(), Fate::kKept));
    counts_.emplace(log_alpha, kept);
    return kept;
}

// By the secant of log count over log alpha, kept between what is known to be too small and too
// large. The count falls with alpha, but for ripples.
double AlphaSearch::solve(double wanted) {
    const double aim = std::log(std::max(wanted, 1.0));
    constexpr double kUsualSlope = -1.5;
    constexpr double kNear = kTolerance / 3;
    constexpr double kWidest = 3;
    double at = last_;
    double low = -std::numeric_limits<double>::infinity();  // keeps too many
    double high = std::numeric_limits<double>::infinity();
    double best = at;
    double best_miss = std::numeric_limits<double>::infinity();
    for (int step = 0; step < kMostSteps; ++step) {
        const double miss = std::log(count(at)) - aim;
        if (std::abs(miss) < best_miss) {
            best_miss = std::abs(miss);
            best = at;
        }
        if (std::abs(miss) <= kNear) {
            break;
        }
        (miss > 0 ? low : high) = at;
        // The two known counts nearest to the aim.
        double slope = kUsualSlope;
        const auto above = counts_.upper_bound(at);
        const auto here = counts_.find(at);
        const auto other = above != counts_.end()    ? above
                           : here != counts_.begin() ? std::prev(here)
                                                     : counts_.end();
        if (other != counts_.end() && other->second != here->second) {
            slope = (std::log(other->second) - std::log(here->second)) / (other->first - at);
        }
        double next = slope < 0 ? at - miss / slope : at - miss / kUsualSlope;
        next = std::clamp(next, at - kWidest, at + kWidest);
        if (!(next > low && next < high)) {
            next = (low + high) / 2;
        }
        if (next == at || counts_.contains(next)) {
            break;
        }
        at = next;
    }
    return best;
}

}  // namespace knap
