#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "knap/geometry.hpp"
#include "knap/source.hpp"

namespace knap {

/// The grid of a LAS file.
struct LasGrid {
    CoordinateFormat format;  ///< kInt32
    bool exact = false;       ///< every position of the sources stays where it is
};

/// Chooses the scales and offsets of a LAS file. Those of the sources where all have the same;
/// where they have grids that fit into each other, on each axis the smallest scale, and the first
/// one's offset, moved by whole steps if the box wants it. Otherwise `step` on every axis, doubled
/// until the box spans less than 2^31 of them, and positions move by half of it at most.
///
/// @param sources  at least one
/// @param box      of all positions; may be empty
/// @param step     cloud units, > 0
LasGrid choose_las_grid(std::span<const CoordinateFormat> sources, const Box& box, double step);

/// Puts coordinates of one axis on its grid.
class GridSteps {
  public:
    GridSteps(double scale, double offset) : scale_(scale), offset_(offset), axis_(scale, offset) {}

    /// The step whose place is this coordinate, else the nearest; none outside of 32 bits.
    std::optional<std::int32_t> at(double coordinate) const;

    /// Place of a step.
    double place(std::int32_t step) const { return axis_.at(step); }

  private:
    double scale_;
    double offset_;
    GridAxis axis_;
};

}  // namespace knap
