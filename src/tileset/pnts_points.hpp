#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "knap/source.hpp"

namespace knap {

/// One attribute of the points of a tile.
struct PointsAttribute {
    enum class Kind { kPosition, kColor, kNormal, kGeneric };

    Kind kind = Kind::kGeneric;
    ScalarType type = ScalarType::kFloat32;  ///< none of 64 bits
    int components = 1;
    std::vector<std::byte> values;  ///< of all points, one behind the other
};

/// Whole steps that positions lie at, from 0 on.
struct PositionSteps {
    int bits = 1;     ///< that hold the largest
    double step = 1;  ///< in units of the positions
};

/// A Draco point cloud, and the number by which it knows each attribute.
struct CompressedPoints {
    std::vector<std::byte> bytes;
    std::vector<std::uint32_t> ids;
};

/// Compresses points in the order given: positions as whole steps where they lie at such, all else
/// without loss. The result is decoded again before it is returned.
///
/// @param points      at least one
/// @param attributes  the positions first, floats
/// @throws StorageError if Draco fails or does not give the points back
CompressedPoints compress_points(std::size_t points, std::span<const PointsAttribute> attributes,
                                 const std::optional<PositionSteps>& steps);

}  // namespace knap
