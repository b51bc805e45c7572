#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace knap::app {

/// A command of the program: its flags, and what it does once they are parsed.
struct Command {
    CLI::App* parser = nullptr;
    std::function<void()> run;  ///< throws the errors of knap/error.hpp; prints the result
};

Command add_run(CLI::App& root);
Command add_simplify(CLI::App& root);
Command add_plan(CLI::App& root);
Command add_info(CLI::App& root);
Command add_decode(CLI::App& root);
Command add_verify(CLI::App& root);
Command add_tileset(CLI::App& root);
Command add_evaluate(CLI::App& root);
Command add_view(CLI::App& root);
Command add_synth(CLI::App& root);

}  // namespace knap::app
