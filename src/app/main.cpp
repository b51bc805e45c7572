#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <new>
#include <string>
#include <vector>

#include "app/format.hpp"
#include "app/program.hpp"
#include "app/suggest.hpp"
#include "knap/error.hpp"

namespace {

using knap::ConfigError;
using knap::app::Command;

constexpr int kDone = 0;
constexpr int kUserError = 1;
constexpr int kMachineError = 2;
constexpr int kInterrupted = 130;

/// A flag that the command does not have, with the one that was probably meant.
[[noreturn]] void fail_on_extra(const CLI::App& parser, const std::string& extra) {
    if (!extra.starts_with("-")) {
        throw ConfigError(fmt::format("unexpected argument \"{}\"", extra));
    }
    const std::string flag = extra.substr(0, extra.find('='));
    std::vector<std::string> names;
    for (const CLI::Option* option : parser.get_options()) {
        for (const std::string& name : option->get_lnames()) {
            names.push_back("--" + name);
        }
    }
    const std::vector<std::string_view> candidates(names.begin(), names.end());
    throw ConfigError(fmt::format("unknown flag {}; did you mean {}?", flag,
                                  knap::app::nearest(flag, candidates)));
}

/// The command that was asked for.
const Command& chosen(const CLI::App& root, const std::vector<Command>& commands) {
    std::string names;
    for (const Command& command : commands) {
        names += (names.empty() ? "" : ", ") + command.parser->get_name();
    }
    const std::vector<std::string> extras = root.remaining();
    if (!extras.empty() && extras[0].starts_with("-")) {
        fail_on_extra(root, extras[0]);
    }
    if (!extras.empty()) {
        throw ConfigError(fmt::format("unknown command {}; expected one of {}", extras[0], names));
    }
    for (const Command& command : commands) {
        if (command.parser->parsed()) {
            const std::vector<std::string> unknown = command.parser->remaining();
            if (!unknown.empty()) {
                fail_on_extra(*command.parser, unknown[0]);
            }
            return command;
        }
    }
    throw ConfigError(fmt::format("no command; expected one of {}; knap --help says more", names));
}

/// Says what is wrong, if there is still a standard error to say it on.
int fail(const std::string& message, int status) {
    std::fputs(("knap: error: " + knap::app::one_line(message) + "\n").c_str(), stderr);
    return status;
}

void flush_results() {
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
        throw knap::StorageError("standard output: cannot write");
    }
}

void run_command(int argc, char** argv) {
    const knap::app::Program program = knap::app::make_program();
    CLI::App& root = *program.root;
    try {
        root.parse(argc, argv);
        chosen(root, program.commands).run();
    } catch (const CLI::Success& help_or_version) {
        root.exit(help_or_version);
    }
    flush_results();
}

}  // namespace

int main(int argc, char** argv) {
    try {
        run_command(argc, argv);
        return kDone;
    } catch (const CLI::ParseError& error) {
        return fail(error.what(), kUserError);
    } catch (const knap::Interrupted& error) {
        return fail(error.what(), kInterrupted);
    } catch (const knap::ConfigError& error) {
        return fail(error.what(), kUserError);
    } catch (const knap::InputError& error) {
        return fail(error.what(), kUserError);
    } catch (const std::bad_alloc&) {
        return fail("out of memory; a smaller --memory makes smaller bricks", kMachineError);
    } catch (const std::exception& error) {
        return fail(error.what(), kMachineError);
    }
}
