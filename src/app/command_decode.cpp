#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>

#include "app/commands.hpp"
#include "app/format.hpp"
#include "app/options.hpp"
#include "app/standard_output.hpp"
#include "base/file.hpp"
#include "emit/decode.hpp"

namespace knap::app {

namespace {

void tell(const DecodeResult& result, const std::string& output, std::FILE* to) {
    for (const std::string& note : result.notes) {
        fmt::print(stderr, "knap: {}\n", note);
    }
    fmt::print(to, "{}: {} points, {}\n", output, format_count(result.points),
               format_bytes(result.bytes));
}

}  // namespace

Command add_decode(CLI::App& root) {
    CLI::App* const command =
        root.add_subcommand("decode", "an archive or a .drc file back to an ordinary file");
    const auto path = std::make_shared<std::string>();
    const auto output = std::make_shared<OutputFileOptions>();
    command->add_option("ARCHIVE", *path, "an archive folder, or a .drc file")
        ->type_name("")
        ->required();
    const auto stream = std::make_shared<StreamOptions>();
    add_output_file_options(*command, *output, ".ply, .las, .laz or .xyz; - for standard output");
    add_stream_options(*command, *stream);
    command->footer(
        "Examples:\n"
        "  knap decode scan_archive -o scan.ply\n"
        "  knap decode site_archive -o site.laz\n"
        "  knap decode scan.drc -o scan.xyz --overwrite\n"
        "  knap decode scan_archive -o - --format xyz | sort");
    return {command, [path, output, stream] {
                if (is_standard_output(output->path, *stream)) {
                    const StandardOutput whole(folder_of_this_process(), *stream);
                    tell(decode(*path, whole.file(), true), output->path, stderr);
                    whole.give();
                    return;
                }
                check_output_file(*output);
                tell(decode(*path, output->path, output->overwrite), output->path, stdout);
            }};
}

}  // namespace knap::app
