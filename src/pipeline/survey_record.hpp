#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "survey/survey.hpp"

namespace knap {

/// What the log says of a survey beside the file that holds it.
nlohmann::ordered_json survey_record(const Survey& archive);

/// What the survey of a record has left in a folder.
StagedPoints recorded_points(const nlohmann::ordered_json& record,
                             const std::filesystem::path& folder);

/// Removes what a survey that was stopped has left of positions and columns.
void remove_staged(const std::filesystem::path& scratch);

}  // namespace knap
