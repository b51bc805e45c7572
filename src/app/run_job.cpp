#include "app/run_job.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>

#include "app/progress.hpp"
#include "app/standard_input.hpp"
#include "app/summary.hpp"
#include "knap/error.hpp"
#include "knap/job.hpp"

namespace knap::app {

namespace {

/// What a job needs to go on outlives it.
Report run_to_file(const Job& job, Progress& progress, StandardOutput* output) {
    try {
        return run(job, progress);
    } catch (const Interrupted&) {
        if (output != nullptr) {
            output->keep(true);
        }
        throw;
    } catch (const StorageError&) {
        if (output != nullptr) {
            output->keep(true);
        }
        throw;
    }
}

}  // namespace

void run_job(Job job, const ProgressOptions& options, const StreamOptions& stream) {
    const auto started = std::chrono::steady_clock::now();
    const std::unique_ptr<Progress> progress = make_progress(options);
    const std::unique_ptr<StandardOutput> output = take_standard_output(job, stream);
    const std::unique_ptr<StandardInput> standard_input = take_standard_input(job, *progress);
    Report report = run_to_file(job, *progress, output.get());
    if (output) {
        output->give();
        report.output = kStandardOutput;
    }
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - started;
    if (!output) {
        fmt::print("{}", format_summary(report, elapsed.count()));
    } else if (!options.quiet) {
        fmt::print(stderr, "{}", format_summary(report, elapsed.count()));
    }
}

}  // namespace knap::app
