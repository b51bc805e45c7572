#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "knap/geometry.hpp"
#include "merge/range_law.hpp"
#include "store/ranked_run.hpp"

namespace knap {

/// What a part of the archive says of one of its points.
enum class Fate : std::uint8_t {
    kRepresented,  ///< a kept point marks it
    kKept,
    kOpen  ///< what stands outside decides, or another open point does
};

/// Decides every point of a part that no point outside the part can change (method section 4).
///
/// A point can be marked only by points that come before it, which reach no farther than it does.
/// So a point whose reach touches nothing outside is kept if nothing inside marks it, and, by the
/// same argument, marks nothing outside. What is left open depends only on what other parts
/// leave open: walking the open points of all parts settles the archive.
///
/// The part itself is cut into pieces that fit the cache; what they leave open is walked once more
/// in the whole. The result does not depend on where it is cut.
/// @param points   in the method's order, fewer than 2^32
/// @param outside  boxes that hold all points outside; none: everything is decided
/// @return         one for each point
std::vector<Fate> settle(std::span<const RankedPoint> points, const RangeLaw& range,
                         std::span<const Box> outside);

/// Bytes of memory that settle() takes for each point, that point not counted.
std::uint64_t settle_bytes_per_point();

}  // namespace knap
