#include "app/program.hpp"

namespace knap::app {

namespace {

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
    "  knap view flake                                   look at it in a browser\n"
    "  knap decode flake -o small.ply                    back to an ordinary file\n"
    "  knap COMMAND --help                               flags, units, ranges, defaults";

constexpr const char* kStatuses =
    "Results go to standard output, everything else to standard error. Exit status: 0 done, 1 the\n"
    "input or the parameters are wrong, 2 the machine failed (disk, memory), 130 interrupted.";

}  // namespace

Program make_program() {
    Program program{.root = std::make_unique<CLI::App>(kAbout, "knap"),
                    .commands = {},
                    .examples = kExamples,
                    .statuses = kStatuses};
    CLI::App& root = *program.root;
    root.set_version_flag("--version", "knap " KNAP_VERSION);
    root.footer(program.examples + "\n\n" + program.statuses);
    root.allow_extras();
    root.require_subcommand(0, 1);
    program.commands = {
        add_run(root),     add_simplify(root), add_plan(root), add_info(root),
        add_decode(root),  add_verify(root),   add_view(root), add_evaluate(root),
        add_tileset(root), add_synth(root),
    };
    for (const Command& command : program.commands) {
        command.parser->allow_extras();
    }
    return program;
}

std::vector<std::string> flag_names(const CLI::Option& option) {
    std::vector<std::string> names;
    names.reserve(option.get_snames().size() + option.get_lnames().size());
    for (const std::string& name : option.get_snames()) {
        names.push_back("-" + name);
    }
    for (const std::string& name : option.get_lnames()) {
        names.push_back("--" + name);
    }
    return names;
}

}  // namespace knap::app
