#include "merge/range_law.hpp"

#include <algorithm>
#include <cmath>

namespace knap {

RangeParams with_alpha(const RangeParams& range, double mean_curvature) {
    RangeParams result = range;
    if (range.tolerance > 0) {
        // A cloud without curvature: its largest range is then infinite, whatever the factor.
        result.alpha = std::sqrt(2 * range.tolerance / mean_curvature);
    }
    return result;
}

double RangeLaw::of(double curvature) const {
    const double smallest = range_.alpha * range_.min_factor;
    const double largest = range_.alpha * range_.max_factor;
    if (!(curvature > 0)) {
        return largest;
    }
    const double range = range_.law == RangeLawKind::kChord
                             ? range_.alpha * std::sqrt(mean_curvature_ / curvature)
                             : range_.alpha * mean_curvature_ / curvature;
    return std::clamp(range, smallest, largest);
}

double RangeLaw::reach(double curvature) const {
    return of(curvature) * std::sqrt(shape_.aspect);
}

Region RangeLaw::region(const RankedPoint& point) const {
    const double range = of(point.key);
    if (point.frame.is_none()) {
        return {range, range, point.key, point.frame};
    }
    const double flatness = std::min(point.frame.frame().flatness, shape_.aspect);
    return {range, range * std::sqrt(flatness), point.key, point.frame};
}

}  // namespace knap
