#pragma once

#include <memory>

#include "app/options.hpp"
#include "knap/job.hpp"

namespace knap::app {

/// The observer that shows a job's progress on standard error and stops the job with Interrupted
/// once a signal has come.
/// @throws ConfigError if the mode is not known
std::unique_ptr<Progress> make_progress(const ProgressOptions& options);

}  // namespace knap::app
