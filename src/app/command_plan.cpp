#include <fmt/format.h>

#include <memory>

#include "app/commands.hpp"
#include "app/options.hpp"
#include "app/progress.hpp"
#include "app/standard_input.hpp"
#include "app/standard_output.hpp"
#include "app/summary.hpp"
#include "knap/job.hpp"

namespace knap::app {

Command add_plan(CLI::App& root) {
    CLI::App* const command =
        root.add_subcommand("plan", "what a job would need: points, bricks, memory, disk");
    const auto options = std::make_shared<JobOptions>(*command, JobOptions::Input::kJobOrFiles);
    const auto progress_options = std::make_shared<ProgressOptions>();
    add_progress_options(*command, *progress_options);
    command->footer(
        "Reads the sources once and writes nothing.\n\n"
        "Examples:\n"
        "  knap plan job.toml\n"
        "  knap plan site.laz -o site_archive --alpha 0.5 --memory 1GiB");
    return {command, [options, progress_options] {
                Job job = options->job();
                plan_standard_output(job);
                const std::unique_ptr<Progress> progress = make_progress(*progress_options);
                const auto standard_input = take_standard_input(job, *progress);
                const Forecast result = forecast(job, *progress);
                fmt::print("{}", format_forecast(result, job.resources.memory_bytes));
            }};
}

}  // namespace knap::app
