#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "knap/geometry.hpp"

namespace knap {

/// A point with the radius that it stands for if it is kept.
struct RangedPoint {
    Vec3 position;
    double range = 0;  ///< > 0, cloud units; may be infinite
};

/// What a part of the archive says about its own points, as places in the part, ascending. Those in
/// neither list are represented.
struct Settled {
    std::vector<std::uint32_t> kept;
    std::vector<std::uint32_t> open;  ///< what stands outside decides, or one of these does
};

/// Decides every point of a part that no point outside the part can change (method section 4).
///
/// A point can be marked only by points that come before it, whose ranges are no larger than its
/// own. So a point whose ball touches nothing outside is kept if nothing inside marks it, and, by
/// the same argument, marks nothing outside. What is left open depends only on what other parts
/// leave open: walking the open points of all parts settles the archive.
///
/// The part is halved until a half fits the cache; what halves leave open is walked once more in
/// the whole. The result does not depend on where it is cut.
/// @param points   in the method's order, fewer than 2^32; ranges never decrease
/// @param outside  boxes that hold all points outside; none: everything is decided
Settled settle(std::span<const RangedPoint> points, std::span<const Box> outside);

}  // namespace knap
