#pragma once

#include <cstdint>

#include "knap/geometry.hpp"
#include "store/brick_plan.hpp"
#include "store/occupancy.hpp"

namespace knap {

struct PlanRequest {
    int neighbours = 30;              ///< K: the halo is wide enough for them nearly everywhere
    std::uint64_t target_points = 0;  ///< core points that a brick aims at, > 0
    std::uint64_t most_points = 0;    ///< core and halo points that a brick may hold, > 0
};

/// Splits the occupied box recursively at voxel faces until every brick fits.
///
/// A voxel is never split: a brick of one voxel may hold more than asked for.
/// @param box  of all points of the occupancy
/// @return     bricks in a fixed order; none if the archive is empty
BrickPlan plan_bricks(const Occupancy& occupancy, const Box& box, const PlanRequest& request);

}  // namespace knap
