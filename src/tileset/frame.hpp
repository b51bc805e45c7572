#pragma once

#include <array>

#include "knap/geometry.hpp"
#include "tileset/geocentric.hpp"

namespace knap {

/// A matrix of 4 x 4 as 3D Tiles has it: column behind column.
using Matrix = std::array<double, 16>;

/// Where a box of the cloud lies in the root's coordinates (metres on the Earth, or cloud units):
/// p -> place + axes * (scale * (p - origin)), off by up to `error`.
struct Frame {
    Vec3 origin;                                                  ///< of the box, cloud units
    Vec3 place;                                                   ///< of the origin in the root's
    std::array<Vec3, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< at right angles, length 1
    Vec3 scale{1, 1, 1};  ///< metres a cloud unit, along each axis
    double error = 0;     ///< metres, over the box
};

/// The frame of a box without a place on the Earth: moved, not turned.
Frame local_frame(const Vec3& origin);

/// The frame that is nearest to what the coordinate system makes of a box, by least squares over a
/// grid of 5 x 5 x 5 points.
/// @param box  not empty
/// @throws InputError if a place of the box is not on the Earth
Frame fit_frame(const Box& box, const Vec3& origin, const Geocentric& earth);

/// A place of the root's, seen from the frame: metres along its axes from its origin.
Vec3 seen_from(const Frame& frame, const Vec3& place);

/// From coordinates in the frame to the root's.
/// @param stretch  of each coordinate; (1, 1, 1): they are metres along the axes
Matrix matrix_of(const Frame& frame, const Vec3& stretch);

/// The matrix m that with `outer` makes `inner`: outer * m == inner. Both map three axes at right
/// angles, and move.
Matrix relative_to(const Matrix& outer, const Matrix& inner);

}  // namespace knap
