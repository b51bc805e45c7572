#pragma once

#include <span>
#include <string>
#include <string_view>

#include "knap/params.hpp"

namespace knap::app {

/// The candidate that a mistyped word most likely means: fewest letters to change, where the part
/// before or after the dot alone may match too. Ties go to the earlier candidate.
/// @param candidates  at least one
std::string_view nearest(std::string_view word, std::span<const std::string_view> candidates);

/// The row of the table for a key.
/// @throws ConfigError "`where`: unknown key ...; did you mean ...?"
const Parameter& find_parameter(std::string_view key, std::string_view where);

}  // namespace knap::app
