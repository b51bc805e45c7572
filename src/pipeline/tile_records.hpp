#pragma once

#include <cstddef>
#include <map>

#include "knap/archive.hpp"
#include "pipeline/job_log.hpp"

/// The finished tiles of an unfinished archive in a job's log.
namespace knap {

void record_tile(JobLog& log, std::size_t number, const ManifestTile& tile);

std::map<std::size_t, ManifestTile> read_tiles(const JobLog& log);

}  // namespace knap
