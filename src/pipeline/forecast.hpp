#pragma once

#include <cstdint>
#include <filesystem>

#include "knap/job.hpp"
#include "plan/plan.hpp"
#include "survey/survey.hpp"

namespace knap {

/// The memory of a job, shared out among its stages before it starts.
struct Budgets {
    std::uint64_t survey = 0;  ///< occupancy grids, bytes
    std::uint64_t stage = 0;   ///< everything that a later stage holds, bytes
};

/// @param memory_bytes  resources.memory
Budgets share_memory(std::uint64_t memory_bytes);

/// How bricks are to be cut: what the job asks for, held to what memory allows.
PlanRequest plan_request(const Job& job, const SourceTable& table, const Budgets& budgets);

/// What a planned job will need.
Forecast make_forecast(const Job& job, const Survey& survey, const BrickPlan& plan);

/// Refuses a job that cannot fit.
/// @throws StorageError naming what is needed and what there is
void check_forecast(const Forecast& forecast, const Job& job, const std::filesystem::path& scratch);

/// Where the job's scratch folder is made: resources.scratch, or beside the output.
std::filesystem::path scratch_parent(const Job& job);

}  // namespace knap
