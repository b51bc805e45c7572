#pragma once

#include <array>
#include <cstddef>

#include "knap/source.hpp"

namespace knap {

/// The narrowest form that keeps coordinates stored as these types: floats, whole numbers, doubles.
CoordinateFormat format_of_coordinates(const std::array<ScalarType, 3>& types);

/// Takes one coordinate of `n` points out of records that lie `stride` bytes apart.
/// @param axis  0, 1, 2
/// @param swap  values are in the other byte order than this machine's
void decode_coordinate(const std::byte* from, std::size_t stride, std::size_t n, Vec3* to, int axis,
                       ScalarType type, bool swap);

}  // namespace knap
