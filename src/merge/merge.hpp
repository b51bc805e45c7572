#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "knap/geometry.hpp"
#include "knap/params.hpp"
#include "store/ranked_run.hpp"
#include "store/selection.hpp"

namespace knap {

struct MergeRequest {
    RangeParams range;
    double mean_curvature = 0;       ///< of the archive, 1 / cloud unit
    std::uint64_t points = 0;        ///< ids are below this
    Box box;                         ///< of all points
    std::uint64_t budget_bytes = 0;  ///< for the coverage and the batches
};

struct MergeResult {
    Selection selection;
    std::uint64_t kept = 0;
    std::uint64_t represented = 0;
};

/// Radius that a point stands for (method section 3), cloud units.
/// @param curvature  |H| of the point, >= 0; 0 gives the largest radius
double range_of(double curvature, double mean_curvature, const RangeParams& range);

/// Walks all streams in one global order: a point that no kept point has marked is kept and marks
/// every point within its range (method section 4).
///
/// Points are taken in batches: a batch is tested in parallel against what was kept before it, and
/// the few survivors are settled in order. Memory grows with the kept points, not with the input.
/// @param streams  each in the method's order; together every counted point once
/// @throws StorageError if the kept points need more memory than the budget, with the figures
MergeResult merge(std::vector<std::unique_ptr<RankedStream>> streams, const MergeRequest& request,
                  const std::function<void(std::uint64_t)>& advance);

}  // namespace knap
