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

/// Tells which attributes of the sources the output will not have: nothing is dropped without a
/// word.
void tell_what_stays_behind(const SourceTable& table, Progress& progress);

}  // namespace knap
