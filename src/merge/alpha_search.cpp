#include "merge/alpha_search.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <utility>

#include "base/checksum.hpp"
#include "merge/range_law.hpp"
#include "merge/settle.hpp"

namespace knap {

namespace {

// A sample of fewer points is off by more than it saves.
constexpr double kFewestPoints = 1 << 17;
constexpr double kMostPoints = 1 << 20;
constexpr double kShare = 1.0 / 8;
// How far the size of a sample may be from what it is meant to be: cells are not alike.
constexpr double kUneven = 2;
// Side of a cell in mean spacings: many ranges wide, so that few of its points are near its faces.
constexpr double kCellSpacings = 64;
// Steps of the search in the sample, and walks over all points, at most.
constexpr int kMostSteps = 24;
constexpr int kMostTries = 10;
// Log count over log alpha, usually.
constexpr double kUsualSlope = -1.5;
constexpr double kWidestStep = 3;

double meant_share(std::uint64_t points) {
    const auto n = static_cast<double>(points);
    return n > 0 ? std::min(1.0, std::clamp(n * kShare, kFewestPoints, kMostPoints) / n) : 1;
}

std::int64_t cell_index(double coordinate, double cells_per_unit) {
    // A far outlier may lie beyond all whole numbers.
    constexpr double kFarthest = 0x1p62;
    return static_cast<std::int64_t>(
        std::clamp(std::floor(coordinate * cells_per_unit), -kFarthest, kFarthest));
}

// To 24 bits: the last bits of the mathematics library are not the same on every machine.
double rounded(double value) {
    constexpr int kBits = 24;
    int exponent = 0;
    const double mantissa = std::frexp(value, &exponent);
    return std::ldexp(std::round(std::ldexp(mantissa, kBits)), exponent - kBits);
}

double log_of(double count) {
    return std::log(std::max(count, 1.0));
}

// Where the line through two places of a falling function meets an aim; no farther than a step.
double secant(double x0, double y0, double x1, double y1, double aim) {
    const double slope = (y1 - y0) / (x1 - x0);
    const double step = (aim - y1) / (slope < 0 ? slope : kUsualSlope);
    return x1 + std::clamp(step, -kWidestStep, kWidestStep);
}

}  // namespace

SampleCells::SampleCells(std::uint64_t points, double spacing) {
    const double share = meant_share(points);
    most_points_ = share < 1
                       ? static_cast<std::uint64_t>(kUneven * share * static_cast<double>(points))
                       : points;
    if (!(share < 1) || !(spacing > 0)) {
        return;
    }
    int exponent = 0;
    std::frexp(spacing * kCellSpacings, &exponent);
    // The inverse of every power of two down to this one is a power of two as well.
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
    const auto n = static_cast<double>(goal.points);
    share_ = static_cast<double>(sample_.size()) / std::max(n, 1.0);
    const double meant = meant_share(goal.points);
    if (share_ < meant / kUneven || share_ > meant * kUneven) {
        sample_.clear();
    }
    sample_.shrink_to_fit();
    // As if each kept point had a square for itself; most are flatter than the mean, and so have
    // larger ranges than alpha.
    constexpr double kUsualFactor = 2;
    const double all_over_kept = n / static_cast<double>(std::max<std::uint64_t>(goal.wanted, 1));
    last_ = std::log(kUsualFactor * std::max(goal.spacing, std::numeric_limits<double>::min()) *
                     std::sqrt(std::max(all_over_kept, 1.0)));
}

double AlphaSearch::next() {
    ++tries_;
    const auto wanted = static_cast<double>(goal_.wanted);
    if (best_again_) {
        last_ = *best_again_;
    } else if (goal_.wanted >= goal_.points || !(goal_.spacing > 0)) {
        // Ranges so small that they hold no other point.
        constexpr double kSmallest = 40;
        last_ = std::log(goal_.spacing > 0 ? goal_.spacing : 1.0) - kSmallest;
    } else if (walks_.size() >= 2) {
        last_ = solve_in_walks();
    } else if (!sample_.empty()) {
        const double off = walks_.empty() ? 1 : walks_.begin()->second * share_ / count(last_);
        last_ = solve_in_sample(wanted * share_ / off, last_);
    } else if (!walks_.empty()) {
        const double miss = log_of(walks_.begin()->second) - std::log(wanted);
        last_ -= std::clamp(miss / kUsualSlope, -kWidestStep, kWidestStep);
    }
    return rounded(std::exp(last_));
}

void AlphaSearch::told(double alpha, std::uint64_t kept) {
    const auto wanted = static_cast<double>(goal_.wanted);
    const auto miss = [&](double count) { return std::abs(count / wanted - 1); };
    const auto count = static_cast<double>(kept);
    last_ = std::log(alpha);
    const bool is_new = walks_.emplace(last_, count).second;
    done_ = best_again_ || miss(count) <= kTolerance || goal_.wanted >= goal_.points ||
            !(goal_.spacing > 0);
    if (done_ || (is_new && tries_ < kMostTries)) {
        return;
    }
    // No more walks: the best one is made again, unless it was this one.
    const auto best = std::min_element(
        walks_.begin(), walks_.end(),
        [&](const auto& a, const auto& b) { return miss(a.second) < miss(b.second); });
    best_again_ = best->first;
    done_ = best->second == count;
}

double AlphaSearch::count(double log_alpha) {
    const auto known = counts_.find(log_alpha);
    if (known != counts_.end()) {
        return known->second;
    }
    RangeParams range = goal_.range;
    range.alpha = rounded(std::exp(log_alpha));
    const std::vector<Fate> fates =
        settle(sample_, RangeLaw(range, goal_.mean_curvature), std::span<const Box>());
    const auto kept = static_cast<double>(std::count(fates.begin(), fates.end(), Fate::kKept));
    counts_.emplace(log_alpha, std::max(kept, 1.0));
    return std::max(kept, 1.0);
}

// By the secant of log count over log alpha, kept between what is known to be too small and too
// large. The count falls with alpha, but for ripples.
double AlphaSearch::solve_in_sample(double wanted, double start) {
    const double aim = log_of(wanted);
    constexpr double kNear = kTolerance / 3;
    double at = start;
    double low = -std::numeric_limits<double>::infinity();  // keeps too many
    double high = std::numeric_limits<double>::infinity();
    double best = at;
    double best_miss = std::numeric_limits<double>::infinity();
    for (int step = 0; step < kMostSteps; ++step) {
        const double found = log_of(count(at));
        const double miss = found - aim;
        if (std::abs(miss) < best_miss) {
            best_miss = std::abs(miss);
            best = at;
        }
        if (std::abs(miss) <= kNear) {
            break;
        }
        (miss > 0 ? low : high) = at;
        const auto here = counts_.find(at);
        const auto other = std::next(here) != counts_.end() ? std::next(here)
                           : here != counts_.begin()        ? std::prev(here)
                                                            : counts_.end();
        double next = at - std::clamp(miss / kUsualSlope, -kWidestStep, kWidestStep);
        if (other != counts_.end()) {
            next = secant(other->first, log_of(other->second), at, found, aim);
        }
        if (!(next > low && next < high)) {
            next = (low + high) / 2;
        }
        if (counts_.contains(next)) {
            break;
        }
        at = next;
    }
    return best;
}

// Between the nearest walk that kept too many and the nearest that kept too few; else beyond the
// two that came nearest.
double AlphaSearch::solve_in_walks() const {
    const double aim = std::log(static_cast<double>(goal_.wanted));
    const auto enough = std::find_if(walks_.begin(), walks_.end(),
                                     [&](const auto& walk) { return log_of(walk.second) <= aim; });
    if (enough == walks_.begin() || enough == walks_.end()) {
        const auto last = enough == walks_.end() ? std::prev(walks_.end()) : walks_.begin();
        const auto before = enough == walks_.end() ? std::prev(last) : std::next(last);
        return secant(before->first, log_of(before->second), last->first, log_of(last->second),
                      aim);
    }
    const auto more = std::prev(enough);
    const double at =
        secant(more->first, log_of(more->second), enough->first, log_of(enough->second), aim);
    // Not so near to an end that the interval hardly shrinks.
    constexpr double kMargin = 0.02;
    const double width = enough->first - more->first;
    return std::clamp(at, more->first + kMargin * width, enough->first - kMargin * width);
}

}  // namespace knap
