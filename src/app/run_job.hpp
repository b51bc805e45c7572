#pragma once

#include "app/options.hpp"
#include "knap/params.hpp"

namespace knap::app {

/// Runs a job with its progress on standard error and prints the summary.
void run_job(Job job, const ProgressOptions& options);

}  // namespace knap::app
