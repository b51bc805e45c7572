#include <memory>

#include "app/commands.hpp"
#include "app/options.hpp"
#include "app/run_job.hpp"

namespace knap::app {

Command add_run(CLI::App& root) {
    CLI::App* const command = root.add_subcommand("run", "simplify what a job file says");
    const auto job = std::make_shared<JobOptions>(*command, JobOptions::Input::kJob);
    const auto progress = std::make_shared<ProgressOptions>();
    const auto stream = std::make_shared<StreamOptions>();
    add_progress_options(*command, *progress);
    add_stream_options(*command, *stream);
    command->footer(
        "Flags win over --set, which wins over the job file. configs/archive.toml has every key.\n"
        "What the resources say never changes the result.\n\n"
        "Examples:\n"
        "  knap run configs/quickstart.toml\n"
        "  knap run job.toml --set range.alpha=0.4 --overwrite\n"
        "  knap run job.toml --memory 1GiB --progress json 2> progress.jsonl");
    return {command, [job, progress, stream] { run_job(job->job(), *progress, *stream); }};
}

}  // namespace knap::app
