#pragma once

#include <cstdint>
#include <string>

namespace knap {

/// "1,234,567"
std::string format_count(std::uint64_t count);

/// "0.12 s", "2 min 03 s", "1 h 02 min"
std::string format_seconds(double seconds);

/// A share in percent: "7.4 %"; "-" of nothing.
std::string format_share(std::uint64_t part, std::uint64_t whole);

}  // namespace knap
