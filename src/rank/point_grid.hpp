#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "knap/geometry.hpp"

namespace knap {

/// The points of a brick sorted into voxels by OpenVDB's PointIndexGrid.
class PointGrid {
  public:
    /// @param points      finite, fewer than 2^32; must outlive the grid
    /// @param voxel_size  edge wanted, > 0, cloud units; made larger where the brick is so wide that
    ///                    its voxels could not be numbered
    PointGrid(std::span<const Vec3> points, double voxel_size);
    ~PointGrid();
    PointGrid(const PointGrid&) = delete;
    PointGrid& operator=(const PointGrid&) = delete;

    /// Indices of all points voxel by voxel, neighbouring voxels near each other; `begins` gets the
    /// place of the first point of each voxel. The order inside a voxel is that of the points.
    std::vector<std::uint32_t> order(std::vector<std::uint32_t>& begins) const;

    /// What nearest_other() finds.
    struct Nearest {
        double squared_distance;  ///< to the nearest point elsewhere that was found; may be infinite
        bool complete;            ///< no point of the grid elsewhere is nearer
        bool lowest_id;           ///< no point with the same coordinates has a lower id
    };

    /// Nearest point with other coordinates, looking at most `max_ring` voxels away. Thread-safe.
    Nearest nearest_other(std::uint32_t index, std::span<const PointId> ids, int max_ring) const;

    /// Bytes a point that a grid takes, for planning.
    static constexpr std::uint64_t kBytesPerPoint = 24;

  private:
    struct Grid;
    std::span<const Vec3> points_;
    std::unique_ptr<Grid> grid_;
};

}  // namespace knap
