#pragma once

#include <array>

#include "emit/lattice.hpp"
#include "emit/tiles.hpp"
#include "knap/archive.hpp"
#include "tileset/frame.hpp"
#include "tileset/geocentric.hpp"

namespace knap {

/// How the points of one tile are written: as whole lattice steps in a frame that is bent no more
/// than half a step, or as floats that lie where the coordinate system has them.
struct Placement {
    Lattice lattice;
    LatticeIndex origin{};  ///< of the coordinates
    Frame frame;
    bool whole_steps = false;  ///< of less than 2^16, so that CesiumJS takes them
    Vec3 unit{1, 1, 1};        ///< of a coordinate along each axis: coordinates a cloud unit
    Matrix matrix{};           ///< from coordinates to the root's
    Box box;                   ///< of the region, in coordinates
    double largest_error = 0;  ///< of a point, metres or cloud units: of the frame and of floats
};

/// Places a tile.
/// @param region  of all points of the tile and below
/// @param earth   none: cloud units stay as they are
/// @throws InputError if a place in the region is not on the Earth
Placement place_tile(const LatticeBounds& region, const Lattice& lattice, const Geocentric* earth);

/// The coordinates of a point of the region.
/// @param earth  as above
/// @throws InputError if it is not on the Earth
std::array<float, 3> coordinates_of(const Placement& placement, const LatticeIndex& point,
                                    const Geocentric* earth);

}  // namespace knap
