#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "survey/survey.hpp"

namespace knap {

/// What the log says of a survey beside the file that holds it.
nlohmann::ordered_json survey_record(const Survey& archive);

/// The positions that the survey of a record has left in a folder.
std::vector<PositionFile> recorded_positions(const nlohmann::ordered_json& record,
                                             const std::filesystem::path& folder);

/// Removes what a survey that was stopped has left of positions.
void remove_positions(const std::filesystem::path& scratch);

/// Where the survey of some files writes positions: a folder with room for them, or nowhere.
std::filesystem::path positions_folder(const std::vector<std::filesystem::path>& files,
                                       const std::filesystem::path& scratch);

}  // namespace knap
