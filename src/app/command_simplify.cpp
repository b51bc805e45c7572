#include <memory>

#include "app/commands.hpp"
#include "app/options.hpp"
#include "app/run_job.hpp"

namespace knap::app {

Command add_simplify(CLI::App& root) {
    CLI::App* const command = root.add_subcommand("simplify", "the same without a job file");
    const auto job = std::make_shared<JobOptions>(*command, JobOptions::Input::kFiles);
    const auto progress = std::make_shared<ProgressOptions>();
    const auto stream = std::make_shared<StreamOptions>();
    add_progress_options(*command, *progress);
    add_stream_options(*command, *stream);
    command->footer(
        "Reads PLY, LAS, LAZ (COPC too), PCD, Draco, XYZ, CSV, TXT, PTS and PTX, PLY and text\n"
        "behind gzip, its own archives, and standard input as -. What --memory, --threads,\n"
        "--scratch and --brick-points say never changes the result. -o - writes PLY, or text with\n"
        "--format xyz, to standard output once it is whole, and the summary to standard error.\n"
        "About 5 mean spacings is a first alpha.\n\n"
        "Examples:\n"
        "  knap simplify scan.ply -o scan_archive --alpha 0.4\n"
        "  knap simplify tiles/ extra.laz -o site.drc --alpha 0.5 --memory 1GiB\n"
        "  knap simplify 'site/*.laz' -o site.ply --alpha 0.5 --max-factor inf --ids kept.txt\n"
        "  zcat scan.xyz.gz | knap simplify - -o - --alpha 0.4 --format xyz | head");
    return {command, [job, progress, stream] { run_job(job->job(), *progress, *stream); }};
}

}  // namespace knap::app
