#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>

#include "app/commands.hpp"
#include "app/format.hpp"
#include "app/options.hpp"
#include "base/file.hpp"
#include "emit/decode.hpp"

namespace knap::app {

Command add_decode(CLI::App& root) {
    CLI::App* const command =
        root.add_subcommand("decode", "an archive or a .drc file back to an ordinary file");
    const auto path = std::make_shared<std::string>();
    const auto output = std::make_shared<OutputFileOptions>();
    command->add_option("ARCHIVE", *path, "an archive folder, or a .drc file")
        ->type_name("")
        ->required();
    add_output_file_options(*command, *output, ".ply, .las, .laz or .xyz");
    command->footer(
        "Examples:\n"
        "  knap decode scan_archive -o scan.ply\n"
        "  knap decode site_archive -o site.laz\n"
        "  knap decode scan.drc -o scan.xyz --overwrite");
    return {command, [path, output] {
                check_output_file(*output);
                const DecodeResult result = decode(*path, output->path, output->overwrite);
                for (const std::string& note : result.notes) {
                    fmt::print(stderr, "knap: {}\n", note);
                }
                fmt::print("{}: {} points, {}\n", output->path, format_count(result.points),
                           format_bytes(result.bytes));
            }};
}

}  // namespace knap::app
