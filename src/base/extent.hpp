#pragma once

#include "knap/geometry.hpp"

namespace knap {

/// Checks that distances inside a box can be squared.
/// @throws InputError naming the box if they overflow
void check_extent(const Box& box);

}  // namespace knap
