#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <new>
#include <string>
#include <vector>

#include "app/commands.hpp"
#include "app/format.hpp"
#include "app/suggest.hpp"
#include "knap/error.hpp"

namespace {

using knap::ConfigError;
using knap::app::Command;

constexpr int kDone = 0;
constexpr int kUserError = 1;
constexpr int kMachineError = 2;
constexpr int kInterrupted = 130;

constexpr const char* kAbout =
    "knap: feature-preserving simplification of point clouds of any size.\n"
    "Keeps the points that carry the shape (ridges, edges, corners), drops those that a neighbour\n"
    "can stand for, and writes Draco. The archive never has to fit in memory.";

constexpr const char* kExamples =
    "Start here:\n"
    "  knap synth flake --points 1000000 -o flake.ply    a cloud to try things on\n"
    "  knap info flake.ply                               what is in a file\n"
    "  knap simplify flake.ply -o flake --alpha 0.25     simplify it into an archive\n"
    "  knap verify flake                                 check the archive\n"
    "  knap decode flake -o small.ply                    back to an ordinary file\n"
    "  knap COMMAND --help                               flags, units, ranges, defaults\n\n"
    "Results go to standard output, everything else to standard error. Exit status: 0 done, 1 the\n"
    "input or the parameters are wrong, 2 the machine failed (disk, memory), 130 interrupted.";

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
    CLI::App root(kAbout, "knap");
    root.set_version_flag("--version", "knap " KNAP_VERSION);
    root.footer(kExamples);
    root.allow_extras();
    root.require_subcommand(0, 1);
    const std::vector<Command> commands{
        knap::app::add_run(root),      knap::app::add_simplify(root), knap::app::add_plan(root),
        knap::app::add_info(root),     knap::app::add_decode(root),   knap::app::add_verify(root),
        knap::app::add_evaluate(root), knap::app::add_synth(root),
    };
    for (const Command& command : commands) {
        command.parser->allow_extras();
    }
    try {
        root.parse(argc, argv);
        chosen(root, commands).run();
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
