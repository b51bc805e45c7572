#include "merge/range_law.hpp"

#include <algorithm>

namespace knap {

double RangeLaw::of(double curvature) const {
    const double smallest = range_.alpha * range_.min_factor;
    const double largest = range_.alpha * range_.max_factor;
    if (!(curvature > 0)) {
        return largest;
    }
    return std::clamp(range_.alpha * mean_curvature_ / curvature, smallest, largest);
}

}  // namespace knap
