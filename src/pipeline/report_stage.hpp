#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/scratch.hpp"
#include "knap/job.hpp"
#include "pipeline/job_log.hpp"
#include "pipeline/merge_files.hpp"
#include "pipeline/merge_stage.hpp"
#include "rank/rank.hpp"
#include "report/curvature_histogram.hpp"
#include "report/drawing.hpp"
#include "report/report_page.hpp"
#include "store/source_table.hpp"

namespace knap {

/// Why a run that asks for a report cannot go on with what an earlier one left: that drew nothing,
/// and has removed points. Empty if it can.
std::string why_no_report(const JobLog& log);

/// Pictures and figures of a job. All points are drawn before merge removes any, and the drawing
/// goes to scratch; the kept ones before emit. What is shown does not depend on the cut.
class ReportStage {
  public:
    /// What is told how many points were handled.
    using Advance = std::function<void(std::uint64_t)>;

    /// References must outlive the object.
    ReportStage(const SourceTable& table, const RankResult& ranked, const MergeFiles& files,
                ScratchFolder& scratch, JobLog& log);

    /// All points; what is in the log is not drawn again.
    void draw_all(const Advance& advance);

    /// The kept points, in every view.
    /// @param range  of the job, with the alpha that was given or found
    /// @param note   told of damaged runs that the sources stand in for
    void draw_kept(const Merged& merged, const RangeParams& range, const Advance& advance,
                   const std::function<void(const std::string&)>& note);

    /// The page.
    /// @param job  with the alpha that was given or found
    std::string page(const Job& job, const Report& report);

  private:
    using TakeRanked = MergeFiles::TakeRanked;

    std::filesystem::path file() const;
    void measure_and_draw(const Advance& advance);
    /// @param begin  as MergeFiles::read_ranked() has it
    void read_kept(const Merged& merged, const std::function<TakeRanked()>& begin,
                   const std::function<void(const std::string&)>& note) const;

    const SourceTable& table_;
    const RankResult& ranked_;
    const MergeFiles& files_;
    ScratchFolder& scratch_;
    JobLog& log_;
    CurvatureScale scale_;
    CurvatureHistogram all_;
    CurvatureHistogram kept_;
    CurvatureColours colours_;
    std::vector<ReportView> views_;
};

}  // namespace knap
