#include "merge/region.hpp"

#include <algorithm>
#include <cmath>

#include "base/vector.hpp"

namespace knap {

bool holds(const Region& region, const RegionShape& shape, const Vec3& offset) {
    if (region.frame.is_none()) {
        return true;
    }
    const LocalFrame frame = region.frame.frame();
    const double u = dot(offset, frame.steepest);
    const double v = dot(offset, frame.flattest);
    const double w = dot(offset, frame.normal);
    const double flatness = std::min(frame.flatness, shape.aspect);
    if (flatness > 1 &&
        !(flatness * (u * u) + v * v / flatness + w * w <= region.range * region.range)) {
        return false;
    }
    const double bend = region.curvature * (u * u + v * v) / 2;
    return shape.slab == 0 || std::abs(w - bend) <= shape.slab * region.range;
}

}  // namespace knap
