#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "curvature/neighbour_search.hpp"
#include "knap/geometry.hpp"

namespace knap {

/// A point whose neighbours may lie outside its own brick's halo.
struct Straggler {
    Vec3 position;
    PointId id = 0;
    /// Its neighbours are known to lie within this distance, squared; infinite if nothing is known.
    double bound_squared = std::numeric_limits<double>::infinity();
};

/// A neighbour with its position, which may be in any brick.
struct FoundNeighbour {
    double squared_distance = 0;
    PointId id = 0;
    Vec3 position;
};

/// Points of one brick's core without coincident ones.
struct CorePoints {
    std::vector<Vec3> positions;
    std::vector<PointId> ids;
};

/// The bricks of an archive, as far as gathering needs them: or other parts of it, which may hold
/// points that coincide with points of another part.
struct CoreAccess {
    std::vector<Box> boxes;                             ///< of each brick's core points
    std::function<CorePoints(std::size_t brick)> load;  ///< @throws StorageError
};

/// True nearest neighbours of stragglers out of all bricks: loads each brick that can hold one,
/// one at a time.
/// @param k  neighbours wanted, > 0
/// @return   for each straggler up to k neighbours by (distance, id), nearest first
std::vector<std::vector<FoundNeighbour>> gather(std::span<const Straggler> stragglers,
                                                std::size_t k, const CoreAccess& cores);

/// The square of the distance from a point to the nearest face of a brick's halo behind which the
/// archive goes on. No point that the brick does not hold is nearer, by the arithmetic of
/// squared_distance(): each step of it is monotone.
/// @param halo     the brick holds every point in this box
/// @param archive  box of all points; must contain `halo`
double certain_squared_distance(const Vec3& p, const Box& halo, const Box& archive);

}  // namespace knap
