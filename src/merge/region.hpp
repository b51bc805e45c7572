#pragma once

#include "knap/geometry.hpp"
#include "knap/params.hpp"
#include "store/local_frame.hpp"

namespace knap {

/// How the regions that kept points stand for differ from balls.
struct RegionShape {
    double slab = 0;    ///< half its thickness over the range; 0: no slab
    double aspect = 1;  ///< most by which a region is longer than wide, >= 1

    RegionShape() = default;
    explicit RegionShape(const RangeParams& range) : slab(range.slab), aspect(range.aspect) {}

    bool is_ball() const { return slab == 0 && aspect == 1; }
};

/// True if regions need the frames of the points.
inline bool needs_frames(const RangeParams& range) {
    return !RegionShape(range).is_ball();
}

/// The points that a kept point stands for: those within a radius of it, or fewer.
struct Region {
    double range = 0;      ///< radius of the ball, or of one that covers as much surface; > 0
    double reach = 0;      ///< nothing farther than this is inside; >= range, may be infinite
    double curvature = 0;  ///< |H| that the point is ranked by, 1 / cloud unit
    PackedFrame frame{};   ///< none: the ball
};

/// True if the point at an offset from the kept point, within its reach, is in its region. With the
/// frame (u steepest, v flattest, w normal) of the kept point and f its flatness, at most aspect:
///
///     f u^2 + v^2 / f + w^2 <= range^2        and        |w - |H| (u^2 + v^2) / 2| <= slab * range
///
/// The second holds of points near the surface that the kept point is on, but not of points behind
/// it: a sphere of curvature |H| stands for that surface.
/// @param offset  from the kept point, cloud units
bool holds(const Region& region, const RegionShape& shape, const Vec3& offset);

}  // namespace knap
