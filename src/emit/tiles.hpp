#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "emit/lattice.hpp"

namespace knap {

/// Sides of a tile, in lattice steps, stay below 2^20: what its floats hold to a quarter of a step.
inline constexpr int kTileBits = 20;

/// Lowest and highest index on each axis.
struct LatticeBounds {
    LatticeIndex min{};
    LatticeIndex max{};
    friend bool operator==(const LatticeBounds&, const LatticeBounds&) = default;
};

/// A point that carries something: the row of that number. Of points in one place the one of the
/// lower row comes first, so rows are to be in the order of ids.
struct CarryingPoint {
    LatticeIndex index{};
    std::uint64_t row = 0;
    // NOLINTNEXTLINE(modernize-use-nullptr): a mistake of clang-tidy 14
    friend auto operator<=>(const CarryingPoint&, const CarryingPoint&) = default;
};

inline const LatticeIndex& place_of(const LatticeIndex& point) {
    return point;
}
inline const LatticeIndex& place_of(const CarryingPoint& point) {
    return point.index;
}

/// The bounds of some points; all zero if there are none.
LatticeBounds bounds_of(std::span<const LatticeIndex> points);
LatticeBounds bounds_of(std::span<const CarryingPoint> points);

/// True if one tile can hold points within these bounds.
bool fits_tile(const LatticeBounds& bounds);

/// The axis along which bounds are widest, the first of equally wide ones.
std::size_t longest_axis(const LatticeBounds& bounds);

/// The order in which points are halved: by the coordinate along one axis, then by the others, then
/// by what they carry, so that which points land in which half does not depend on the order they
/// came in. Points equal in all of it are interchangeable.
struct AlongAxis {
    std::size_t axis = 0;

    template <typename Point>
    bool operator()(const Point& a, const Point& b) const {
        const std::int64_t at_a = place_of(a)[axis];
        const std::int64_t at_b = place_of(b)[axis];
        return at_a != at_b ? at_a < at_b : a < b;
    }
    /// The axes by which points are compared, in turn.
    std::array<std::size_t, 3> axes() const {
        return {axis, axis == 0 ? std::size_t{1} : 0, axis == 2 ? std::size_t{1} : 2};
    }
};

/// A tile: some consecutive points of the planned order.
struct TileSpan {
    std::size_t first = 0;
    std::size_t count = 0;  ///< >= 1
    LatticeBounds bounds;   ///< of its points
};

/// Cuts the kept points into tiles, by the median along the longest axis until a tile is small
/// enough, and puts the points into the order of the tiles, sorted within each.
///
/// The result is a function of the set of points alone: not of their order.
///
/// @param points       any number; reordered
/// @param tile_points  most points in a tile, >= 1
/// @param poll         called now and then, from any thread; may throw to stop the work
/// @return             tiles that cover all points, lower half first
std::vector<TileSpan> plan_tiles(
    std::span<LatticeIndex> points, std::uint64_t tile_points,
    const std::function<void()>& poll = [] {});
std::vector<TileSpan> plan_tiles(
    std::span<CarryingPoint> points, std::uint64_t tile_points,
    const std::function<void()>& poll = [] {});

}  // namespace knap
