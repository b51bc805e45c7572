#pragma once

#include <filesystem>
#include <vector>

#include "knap/job.hpp"
#include "store/source_table.hpp"

namespace knap {

/// The files that a job's input means, in order. Tells how many files of folders are left out.
/// @throws InputError, ConfigError as expand_sources()
std::vector<std::filesystem::path> find_sources(const Job& job, Progress& progress);

/// What files say of themselves.
/// @throws InputError
std::vector<SourceInfo> source_infos(const std::vector<std::filesystem::path>& files);

/// Refuses attributes that the output could not have, before any work is done.
/// @throws ConfigError as plan_attributes() and check_tile_attributes()
void check_attributes(const Job& job, const std::vector<std::filesystem::path>& files);

/// Tells what of the sources' attributes the output will not have as they have it: nothing is
/// dropped without a word.
void tell_attributes(const Job& job, const SourceTable& table, Progress& progress);

}  // namespace knap
