#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "knap/geometry.hpp"
#include "store/occupancy.hpp"

namespace knap {

/// One brick: what it owns and how far it sees.
struct Brick {
    VoxelBox core;                  ///< voxels whose points it owns
    Box halo;                       ///< it also carries every point in this box, cloud units
    std::uint64_t core_points = 0;  ///< counted in the survey
    std::uint64_t halo_points = 0;  ///< estimated from the occupancy
};

/// Voxels that the core or the halo of a brick touches. Whoever lies in the halo lies in one of
/// them: voxel_index() is monotone.
VoxelBox voxels_touched(const Brick& brick, double voxel_size);

/// How an archive is cut. Every occupied voxel is in exactly one core.
struct BrickPlan {
    double voxel_size = 0;  ///< cloud units, a power of two
    std::vector<Brick> bricks;
};

/// A brick on disk.
struct BrickFile {
    std::filesystem::path path;
    Brick brick;
    Box core_box;  ///< of the core points, cloud units
    std::uint64_t core_points = 0;
    std::uint64_t halo_points = 0;
    std::uint64_t bytes = 0;
};

}  // namespace knap
