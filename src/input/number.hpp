#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "knap/source.hpp"

namespace knap {

/// The whole of `text` as a number, whatever the locale: "1", "+1.5e3", "nan", "-inf". A magnitude
/// beyond the type becomes infinite, one below it zero or subnormal.
std::optional<double> parse_double(std::string_view text);

/// As parse_double, rounded once, to float.
std::optional<float> parse_float(std::string_view text);

/// As a value of `type` as a double. Integer types also take "3.0"; not "3.5", nor what they cannot
/// hold.
std::optional<double> parse_scalar(std::string_view text, ScalarType type);

/// As a value of `type`, exactly, in the byte order of this machine.
/// @param to  gets size_of(type) bytes
/// @return    false, with `to` as it was, where parse_scalar() has no value
bool parse_value(std::string_view text, ScalarType type, std::byte* to);

/// The whole of `text` as a count: decimal digits.
std::optional<std::uint64_t> parse_count(std::string_view text);

/// Foreign text for an error message: in quotes, shortened, in ASCII, on one line.
std::string excerpt(std::string_view text);

}  // namespace knap
