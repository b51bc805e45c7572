#pragma once

#include <string>

#include "app/program.hpp"

namespace knap::app {

/// A completion for bash (4 and later), made from the commands and flags of the program: commands,
/// flags, the names that a flag takes, the keys of --set, else files.
std::string bash_completion(const Program& program);

}  // namespace knap::app
