#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "app/commands.hpp"

namespace knap::app {

/// The whole command line: what main() parses, and what the man page and the completion are made
/// from.
struct Program {
    std::unique_ptr<CLI::App> root;
    std::vector<Command> commands;  ///< in the order of the help
    std::string examples;           ///< a heading, then lines that begin with two spaces
    std::string statuses;           ///< where results and errors go, and the exit status
};

Program make_program();

/// How a flag is written, short names first: -o, --output; empty for a positional.
std::vector<std::string> flag_names(const CLI::Option& option);

}  // namespace knap::app
