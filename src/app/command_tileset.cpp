#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>

#include "app/commands.hpp"
#include "app/format.hpp"
#include "app/options.hpp"
#include "app/progress.hpp"
#include "app/value.hpp"
#include "base/file.hpp"
#include "base/threads.hpp"
#include "knap/params.hpp"
#include "pipeline/stage_clock.hpp"
#include "tileset/tileset.hpp"

namespace knap::app {

namespace {

struct TilesetOptions {
    std::string archive;
    bool overwrite = false;
    std::string memory;
    std::string threads;
    ProgressOptions progress;
};

ResourceParams resources_of(const TilesetOptions& options) {
    Job job;
    for (const Parameter& parameter : parameters()) {
        const std::string* const text = parameter.key == "resources.memory"    ? &options.memory
                                        : parameter.key == "resources.threads" ? &options.threads
                                                                               : nullptr;
        if (text != nullptr && !text->empty()) {
            set_parameter(job, parameter, *text, parameter.flag);
        }
    }
    return job.resources;
}

void make(const TilesetOptions& options) {
    const std::unique_ptr<Progress> progress = make_progress(options.progress);
    const ResourceParams resources = resources_of(options);
    const int threads = thread_count(resources.threads);
    const ThreadLimit limit(threads);
    StageClock clock(*progress);
    const TilesetResult result = clock.time("tileset", 0, [&](const auto& advance) {
        return make_tileset(options.archive, {.threads = threads,
                                              .memory_bytes = resources.memory_bytes,
                                              .overwrite = options.overwrite,
                                              .advance = advance});
    });
    for (const std::string& note : result.notes) {
        progress->note(note);
    }
    fmt::print("{}/tileset/tileset.json: {} points in {} {}, {}, {}\n", options.archive,
               format_count(result.points), format_count(result.tiles),
               result.tiles == 1 ? "tile" : "tiles", format_bytes(result.bytes),
               result.on_earth ? fmt::format("on the Earth, within {:.2g} m", result.largest_error)
                               : fmt::format("in a local frame, within {:.2g} cloud units",
                                             result.largest_error));
}

}  // namespace

Command add_tileset(CLI::App& root) {
    CLI::App* const command =
        root.add_subcommand("tileset", "3D Tiles of an archive, for CesiumJS and others");
    const auto options = std::make_shared<TilesetOptions>();
    command->add_option("ARCHIVE", options->archive, "an archive folder; they go into it")
        ->type_name("")
        ->required();
    command->add_flag("--overwrite", options->overwrite, "replace 3D Tiles that exist");
    command
        ->add_option("--memory", options->memory, "resident memory that it may use; default 4GiB")
        ->type_name("SIZE");
    command->add_option("--threads", options->threads, "threads; 0: one a core; default 0")
        ->type_name("INTEGER");
    add_progress_options(*command, options->progress);
    command->footer(
        "Writes ARCHIVE/tileset/tileset.json and .pnts files beside it, compressed by Draco. They\n"
        "stand on the Earth where the archive's coordinate system is known. --tileset of simplify\n"
        "and run does the same.\n\n"
        "Example:\n  knap tileset site_archive");
    return {command, [options] { make(*options); }};
}

}  // namespace knap::app
