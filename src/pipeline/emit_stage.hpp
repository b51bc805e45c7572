#pragma once

#include <cstdint>

#include "base/scratch.hpp"
#include "input/staged_reader.hpp"
#include "knap/job.hpp"
#include "pipeline/job_log.hpp"
#include "pipeline/merge_stage.hpp"
#include "pipeline/report_stage.hpp"
#include "pipeline/stage_clock.hpp"
#include "rank/rank.hpp"
#include "store/source_table.hpp"

namespace knap {

/// What the stage is given; references must outlive it.
struct EmitStage {
    const Job& job;
    const SourceTable& table;
    const RankResult& ranked;
    const Merged& merged;
    const StagedPoints& staged;  ///< that is still there
    ScratchFolder& scratch;
    JobLog& log;
    StageClock& clock;
    std::uint64_t memory_bytes = 0;
    int threads = 1;
    ReportStage* report = nullptr;  ///< none: no report is asked for
};

/// Writes the output, and with it the ids and the report where the job asks for them: each of them
/// whole before the output gets its name.
Report emit_output(const EmitStage& stage);

}  // namespace knap
