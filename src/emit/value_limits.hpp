#pragma once

#include "knap/source.hpp"

namespace knap {

/// What can be said of the values of an attribute that two sources have: bounds that hold in both,
/// and the missing value if it is the same.
/// @param type  holds all values of either
ValueLimits common_limits(const Attribute& a, const Attribute& b, ScalarType type);

}  // namespace knap
