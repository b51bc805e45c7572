#pragma once

#include "app/options.hpp"
#include "app/standard_output.hpp"
#include "knap/params.hpp"

namespace knap::app {

/// Runs a job with its progress on standard error and prints the summary: on standard output,
/// unless that is where the cloud goes.
void run_job(Job job, const ProgressOptions& options, const StreamOptions& stream);

}  // namespace knap::app
