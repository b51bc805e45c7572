#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "knap/archive.hpp"
#include "knap/geometry.hpp"
#include "store/source_table.hpp"

namespace knap {

/// Whole steps from the origin of a lattice; ordered by x, then y, then z.
using LatticeIndex = std::array<std::int64_t, 3>;

/// Largest index on a lattice: beyond it doubles would no longer tell neighbours apart.
inline constexpr std::int64_t kLargestLatticeIndex = std::int64_t{1} << 52;

/// The lattice that all points of a job's output are put on.
///
/// With no step given it is the scale of the sources, where all of them store integers on one
/// common grid (the smallest scale, if all others are whole multiples of it), so that their
/// coordinates survive exactly; otherwise the largest power of two <= spacing / 64, which costs
/// nothing visible and makes every local coordinate an exact float. On a common grid
/// the origin is zero where the sources' offsets are whole steps, else the first one's offset;
/// otherwise it is the lower corner of the box, rounded down to a multiple of the step.
///
/// @param step     output.step, cloud units, >= 0; 0: choose
/// @param sources  at least one
/// @param spacing  mean distance to the nearest other point; 0 where there are no two points
/// @throws ConfigError if the step is too small for the box or cannot be held by a float
Lattice choose_lattice(double step, const SourceTable& sources, double spacing);

/// The lattice point nearest to a position.
/// @param position  inside the box that the lattice was chosen for
inline LatticeIndex index_of(const Lattice& lattice, const Vec3& position) {
    return {std::llround((position.x - lattice.origin.x) / lattice.step),
            std::llround((position.y - lattice.origin.y) / lattice.step),
            std::llround((position.z - lattice.origin.z) / lattice.step)};
}

/// Where a lattice point lies, evaluated as LAS readers do: index * step + origin.
inline Vec3 position_of(const Lattice& lattice, const LatticeIndex& index) {
    return {static_cast<double>(index[0]) * lattice.step + lattice.origin.x,
            static_cast<double>(index[1]) * lattice.step + lattice.origin.y,
            static_cast<double>(index[2]) * lattice.step + lattice.origin.z};
}

}  // namespace knap
