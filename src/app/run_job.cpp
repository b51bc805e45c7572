#include "app/run_job.hpp"

#include <fmt/format.h>

#include <chrono>

#include "app/progress.hpp"
#include "app/standard_input.hpp"
#include "app/summary.hpp"
#include "knap/job.hpp"

namespace knap::app {

void run_job(Job job, const ProgressOptions& options) {
    const auto started = std::chrono::steady_clock::now();
    const std::unique_ptr<Progress> progress = make_progress(options);
    const std::unique_ptr<StandardInput> standard_input = take_standard_input(job, *progress);
    const Report report = run(job, *progress);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - started;
    fmt::print("{}", format_summary(report, elapsed.count()));
}

}  // namespace knap::app
