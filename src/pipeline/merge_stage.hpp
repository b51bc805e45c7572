#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "merge/merge.hpp"
#include "pipeline/job_log.hpp"
#include "pipeline/merge_files.hpp"
#include "rank/rank.hpp"
#include "store/source_table.hpp"

namespace knap {

/// What is kept of an archive, and the alpha that did it.
struct Merged {
    MergeResult result;
    double alpha = 0;                    ///< cloud units
    std::uint64_t protected_points = 0;  ///< kept for the sake of range.keep alone
    /// Ranked runs that hold every kept point.
    std::vector<std::filesystem::path> runs;
};

/// What the stage is given; references must outlive it.
struct MergeStage {
    const RangeParams& range;
    const SourceTable& table;
    const RankResult& ranked;
    MergeFiles& files;
    ScratchFolder& scratch;
    JobLog& log;
    std::uint64_t budget_bytes = 0;
    std::function<void(const std::string&)> note;
};

/// The selection, in the scratch folder and in the log.
constexpr const char* kMergedFile = "selection";

/// Tells where a number of points that was wanted is missed by more than 1 %.
/// @param points  of the input
void tell_miss(const RangeParams& range, std::uint64_t points, std::uint64_t kept,
               const std::function<void(const std::string&)>& note);

/// Marks ranges over the archive; where a number of points is wanted, as often as it takes to find
/// the alpha for it. What is done is in the log, and is not done again.
/// @param advance  told the points that were decided; each counts once
Merged merge_archive(const MergeStage& stage, const std::function<void(std::uint64_t)>& advance);

}  // namespace knap
