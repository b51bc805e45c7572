#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "knap/source.hpp"
#include "tileset/pnts_points.hpp"
#include "tileset/properties.hpp"

namespace knap {

/// The points of one tile, in the order in which they are written.
struct PntsPoints {
    std::span<const std::array<float, 3>> positions;  ///< at least one
    std::optional<PositionSteps> steps;               ///< that the positions lie at; none: floats
    std::span<const std::byte> rows;                  ///< as RowLayout has them
};

/// A .pnts file of 3D Tiles with the extension 3DTILES_draco_point_compression.
///
/// Colours have 8 bits: those of 16 are divided by 257 and rounded, or kept where they are all
/// below 256.
///
/// @param attributes     of the rows
/// @param narrow_colors  colours of 16 bits hold values of 8
/// @throws StorageError if Draco fails
std::vector<std::byte> encode_pnts(const PntsPoints& points, std::span<const Attribute> attributes,
                                   const PropertyPlan& plan, bool narrow_colors);

}  // namespace knap
