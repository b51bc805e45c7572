#include <memory>

#include "app/commands.hpp"
#include "app/options.hpp"
#include "app/run_job.hpp"

namespace knap::app {

Command add_simplify(CLI::App& root) {
    CLI::App* const command = root.add_subcommand("simplify", "the same without a job file");
    const auto job = std::make_shared<JobOptions>(*command, JobOptions::Input::kFiles);
    const auto progress = std::make_shared<ProgressOptions>();
    add_progress_options(*command, *progress);
    command->footer(
        "Reads PLY, LAS, LAZ (COPC too), PCD, Draco, XYZ, CSV, TXT and PTS, PLY and text behind\n"
        "gzip, its own archives, and standard input as -. What --memory, --threads, --scratch\n"
        "and --brick-points say never changes the result. About 5 mean spacings is a first\n"
        "alpha.\n\n"
        "Examples:\n"
        "  knap simplify scan.ply -o scan_archive --alpha 0.4\n"
        "  knap simplify tiles/ extra.laz -o site.drc --alpha 0.5 --memory 1GiB\n"
        "  knap simplify 'site/*.laz' -o site.ply --alpha 0.5 --max-factor inf --ids kept.txt");
    return {command, [job, progress] { run_job(job->job(), *progress); }};
}

}  // namespace knap::app
