#pragma once

#include <filesystem>
#include <vector>

#include "knap/job.hpp"

namespace knap {

/// The files that a job's input means, in order. Tells how many files of folders are left out.
/// @throws InputError, ConfigError as expand_sources()
std::vector<std::filesystem::path> find_sources(const Job& job, Progress& progress);

/// What files say of themselves.
/// @throws InputError
std::vector<SourceInfo> source_infos(const std::vector<std::filesystem::path>& files);

}  // namespace knap
