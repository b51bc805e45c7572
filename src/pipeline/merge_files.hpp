#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/scratch.hpp"
#include "merge/merge.hpp"
#include "pipeline/job_log.hpp"
#include "rank/rank.hpp"
#include "store/source_table.hpp"

namespace knap {

/// The scratch files that merge reads and leaves: the runs of each brick; once a brick is settled,
/// what it keeps and what it leaves open instead; what the walk keeps of the open points.
class MergeFiles {
  public:
    /// @param budget_bytes  of the merge; blocks of open runs take a part of it
    /// @param frames        runs carry frames, and merge needs them
    /// @param remake        ranks a brick whose files cannot be read again; told why
    /// All references must outlive the object.
    MergeFiles(ScratchFolder& scratch, JobLog& log, const SourceTable& table,
               std::uint64_t budget_bytes, bool frames, const std::vector<RankedFiles>& bricks,
               std::function<std::vector<RankedPoint>(std::size_t, const std::string& why)> remake);

    /// Every brick as merge takes it: its runs, or what an earlier run found.
    std::vector<RankedPart> parts();

    /// For MergeRequest::on_settled: writes what a brick keeps and leaves open, records it, and
    /// removes the runs of the brick. Thread-safe.
    std::function<std::unique_ptr<RankedStream>(std::size_t, std::span<const RankedPoint>,
                                                std::vector<RankedPoint>)>
    keeper();

    /// The same for an attempt that may not be the last: nothing is recorded, and the runs stay.
    std::function<std::unique_ptr<RankedStream>(std::size_t, std::span<const RankedPoint>,
                                                std::vector<RankedPoint>)>
    attempt_keeper();

    /// For MergeRequest::on_walked.
    std::function<void(std::span<const RankedPoint>)> walk_keeper();

    /// Once merge() has returned: the kept points are whole on disk.
    void finish_walk();

    /// Once the selection is safe: what it was made from, the kept points excepted.
    void remove_undecided();

    /// The kept points of the whole archive, as runs.
    std::vector<std::filesystem::path> kept_runs() const;

    /// All points of the archive, as runs; while nothing was kept by keeper().
    std::vector<std::filesystem::path> ranked_runs() const;

    /// Those of a brick's points that are wanted, in any order.
    std::vector<RankedPoint> ranked_points(
        std::size_t brick, const std::function<bool(const RankedPoint&)>& wanted) const;

    /// Takes some of a brick's points.
    using TakeRanked = std::function<void(std::span<const RankedPoint>)>;

    /// Hands over all points of a brick, in any order; while its runs are there.
    /// @param begin  gives what takes the points of an attempt; called again if those of the
    ///               attempt before do not count, as a run is damaged
    void read_ranked(std::size_t brick, const std::function<TakeRanked()>& begin) const;

    /// What attempts have left.
    void remove_open();

    /// How runs are written that merge reads many of at a time.
    RunLayout open_layout() const;

  private:
    SettledPart load(std::size_t brick, std::uint64_t open_points) const;
    std::unique_ptr<RankedStream> keep(std::size_t brick, std::span<const RankedPoint> kept,
                                       const std::vector<RankedPoint>& open);
    std::unique_ptr<RankedStream> put_away(std::size_t brick, const std::vector<RankedPoint>& open);
    std::vector<RankedPoint> read_run(const std::filesystem::path& path) const;
    std::filesystem::path kept_path(std::size_t brick) const;
    std::filesystem::path open_path(std::size_t brick) const;
    std::filesystem::path walked_path() const;
    void remove(const std::filesystem::path& path);
    void remove_runs(std::size_t brick);

    ScratchFolder& scratch_;
    JobLog& log_;
    const SourceTable& table_;
    std::uint64_t budget_bytes_;
    bool frames_;
    const std::vector<RankedFiles>& bricks_;
    std::function<std::vector<RankedPoint>(std::size_t, const std::string& why)> remake_;
    std::mutex mutex_;
    std::optional<RunWriter> walked_;
};

}  // namespace knap
