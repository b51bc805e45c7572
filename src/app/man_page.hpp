#pragma once

#include <string>

#include "app/program.hpp"

namespace knap::app {

/// The manual page knap(1) as roff, made from the commands and flags of the program itself, so that
/// it says what --help says.
/// @param version  as the footer shows it: "0.1.0"
std::string man_page(const Program& program, const std::string& version);

}  // namespace knap::app
