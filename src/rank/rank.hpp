#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/exact_sum.hpp"
#include "knap/params.hpp"
#include "store/brick_plan.hpp"
#include "store/source_table.hpp"

namespace knap {

/// One brick ranked.
struct RankedFiles {
    std::vector<std::filesystem::path> runs;  ///< one, and those of its stragglers
    Box box;                                  ///< of its points, cloud units
    std::uint64_t points = 0;                 ///< in the runs
};

/// What a brick leaves behind before its stragglers are settled.
struct BrickRank {
    std::filesystem::path run;
    std::filesystem::path straggler_run;  ///< empty if it has no stragglers
    std::uint64_t points = 0;             ///< in the run
    std::uint64_t stragglers = 0;
    std::uint64_t merged = 0;
    ExactSum curvature_sum;  ///< of |H| over the run, 1 / cloud unit
};

/// The stragglers of all bricks, settled.
struct SettledStragglers {
    /// One more run of a brick.
    struct Run {
        std::size_t brick = 0;
        std::filesystem::path path;
        std::uint64_t points = 0;
    };
    std::vector<Run> runs;
    ExactSum curvature_sum;  ///< of |H| over the runs, 1 / cloud unit
};

/// How far an archive has been ranked.
struct RankState {
    std::optional<double> spacing;
    std::vector<std::optional<BrickRank>> bricks;  ///< by number; may be shorter than the archive
    std::optional<SettledStragglers> stragglers;
};

struct RankRequest {
    std::filesystem::path folder;  ///< exists; gets a run a brick
    CurvatureParams curvature;
    bool frames = false;             ///< runs carry the frames of the points too
    std::uint64_t budget_bytes = 0;  ///< for the bricks in work, and those held between passes
    int threads = 1;                 ///< bricks in work at a time, >= 1
    RankState state = {};            ///< where an earlier run stopped
    /// Told each step when what it leaves is in place; one call at a time. What a step needed is
    /// removed only after that.
    std::function<void(double spacing)> on_spacing = [](double) {};
    std::function<void(std::size_t brick, const BrickRank&)> on_brick = [](std::size_t,
                                                                           const BrickRank&) {};
    std::function<void(const SettledStragglers&)> on_stragglers = [](const SettledStragglers&) {};
    /// Makes a brick file that cannot be read again; none: that is an error. From any thread.
    std::function<void(std::size_t brick, const std::string& why)> remake = nullptr;
    /// Told how many bytes of scratch a new file takes, or one that is gone gave back.
    std::function<void(std::int64_t)> on_scratch = [](std::int64_t) {};
};

/// The archive ranked.
struct RankResult {
    std::vector<RankedFiles> bricks;  ///< together they hold every counted point once
    std::uint64_t points = 0;         ///< in the runs
    std::uint64_t merged = 0;
    std::uint64_t stragglers = 0;
    double spacing = 0;         ///< mean distance to the nearest other point, cloud units
    double mean_curvature = 0;  ///< mean |H|, 1 / cloud unit
};

/// Mean curvature of every point of the archive, brick by brick, as ranked runs. A brick file is
/// removed as soon as its run is safe.
///
/// Two passes: the first measures the spacing, which scales the estimator of the second. Points
/// whose neighbours are not certain to lie in their brick are gathered from all bricks after each.
class Ranking {
  public:
    /// What is told how many core points were handled; each point counts once.
    using Advance = std::function<void(std::uint64_t)>;

    /// @param table, bricks  must outlive the object
    Ranking(const SourceTable& table, const std::vector<BrickFile>& bricks, RankRequest request);
    ~Ranking();
    Ranking(const Ranking&) = delete;
    Ranking& operator=(const Ranking&) = delete;

    /// The first pass.
    /// @return mean distance to the nearest other point, cloud units
    /// @throws StorageError if scratch cannot be read
    double measure_spacing(const Advance& advance);

    /// The second pass.
    /// @throws StorageError if scratch cannot be read or written
    RankResult rank(double spacing, const Advance& advance);

  private:
    class Passes;
    std::unique_ptr<Passes> passes_;
};

}  // namespace knap
