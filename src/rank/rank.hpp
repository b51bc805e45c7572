#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "knap/params.hpp"
#include "store/brick_plan.hpp"
#include "store/source_table.hpp"

namespace knap {

struct RankRequest {
    std::filesystem::path folder;  ///< exists; gets a run a brick
    CurvatureParams curvature;
    std::uint64_t budget_bytes = 0;  ///< for all bricks in work
    /// Told how many bytes of scratch a new file takes, or one that is gone gave back.
    std::function<void(std::int64_t)> on_scratch = [](std::int64_t) {};
};

/// One brick ranked.
struct RankedFiles {
    std::vector<std::filesystem::path> runs;  ///< one, and those of its stragglers
    Box box;                                  ///< of its points, cloud units
    std::uint64_t points = 0;                 ///< in the runs
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
/// @param advance  told how many core points were handled; each point counts once
/// @throws StorageError if scratch cannot be read or written
RankResult rank(const SourceTable& table, const std::vector<BrickFile>& bricks,
                const RankRequest& request, const std::function<void(std::uint64_t)>& advance);

/// Bytes of memory that a point of a brick (core or halo) takes while the brick is ranked.
std::uint64_t rank_bytes_per_point();

}  // namespace knap
