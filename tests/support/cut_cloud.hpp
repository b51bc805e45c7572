#pragma once

#include <compare>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include "knap/geometry.hpp"
#include "store/brick_file.hpp"
#include "store/brick_plan.hpp"
#include "store/occupancy.hpp"

/// A cloud cut into bricks in memory, and what its neighbours are, by brute force.
namespace knap::test {

/// The finite points of a cloud; ids are places in the cloud.
struct Points {
    std::vector<Vec3> positions;
    std::vector<PointId> ids;
    Box box;
};
Points finite_points(std::span<const Vec3> cloud);

/// Without coincident points: the lowest id of each stays.
Points distinct_points(std::span<const Vec3> cloud);

/// The occupancy of a cloud whose longest side is about `voxels` voxels long.
Occupancy occupancy_of(const Points& points, double voxels);

/// How far the halos of a cut reach.
enum class Halo {
    kPlanned,  ///< as the planner has it
    kNone,     ///< to the core's own points only: nearly every point is a straggler
    kAll,      ///< over the whole archive: no point is
};

struct CutBrick {
    Brick brick;
    BrickPoints points;  ///< core and halo, each in a random order
    Box core_box;
};

struct CutCloud {
    Box box;
    std::vector<CutBrick> bricks;
};

/// Plans bricks of at most `brick_points` core points (where voxels allow) and fills each by
/// looking at every point.
CutCloud cut_cloud(std::mt19937_64& random, const Points& points, std::uint64_t brick_points,
                   Halo halo);

/// Another point and how far it is. Ordered by (distance, id).
struct Found {
    double squared_distance;
    PointId id;
    friend auto operator<=>(const Found&, const Found&) = default;
};

/// The k nearest points to `query` whose id is not `self`, by looking at every point.
std::vector<Found> nearest_by_force(const Points& points, const Vec3& query, PointId self,
                                    std::size_t k,
                                    double max_squared = std::numeric_limits<double>::infinity());

}  // namespace knap::test
