#pragma once

#include <string>

#include "knap/job.hpp"

namespace knap::app {

/// What a job did, as people read it: counts, spacing, stages, resources, where the result is.
/// @param seconds  wall time of the whole job
std::string format_summary(const Report& report, double seconds);

/// What a job would need.
/// @param memory_bytes  what the job may use
std::string format_forecast(const Forecast& forecast, std::uint64_t memory_bytes);

}  // namespace knap::app
