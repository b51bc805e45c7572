#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "knap/params.hpp"

namespace knap {

/// What makes a run the same as an earlier one: the version of knap, the parameters that shape the
/// result, and the sources with their sizes and times.
nlohmann::ordered_json identity_of(const Job& job, const std::vector<std::filesystem::path>& files);

/// What is different, as a user should read it: "range.alpha was 0.4, is 0.5"; empty if nothing is.
/// A source whose time alone has changed is the same if `same_content` says so.
std::string difference(const nlohmann::ordered_json& before, const nlohmann::ordered_json& now,
                       const std::function<bool(std::size_t source)>& same_content);

/// Name of the scratch folder of a job: the same for every run that writes the same output.
std::string scratch_name(const Job& job);

}  // namespace knap
