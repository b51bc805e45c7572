#pragma once

#include <cstdint>
#include <string>

namespace knap::app {

/// "1,234,567"
std::string format_count(std::uint64_t count);

/// A rate a second: "3.64 M", "820 k"; "-" where nothing was done or measured.
std::string format_rate(double rate);

/// "0.12 s", "2 min 03 s", "1 h 02 min"
std::string format_seconds(double seconds);

/// A share in percent: "7.4 %"; "-" of nothing.
std::string format_share(std::uint64_t part, std::uint64_t whole);

/// Text with control characters and line breaks made visible, so that a message stays one line.
std::string one_line(const std::string& text);

}  // namespace knap::app
