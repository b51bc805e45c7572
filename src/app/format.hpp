#pragma once

#include <string>

#include "base/format.hpp"

namespace knap::app {

/// A rate a second: "3.64 M", "820 k"; "-" where nothing was done or measured.
std::string format_rate(double rate);

/// Text with control characters and line breaks made visible, so that a message stays one line.
std::string one_line(const std::string& text);

}  // namespace knap::app
