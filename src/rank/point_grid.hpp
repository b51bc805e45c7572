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
    /// @param voxel_size  edge wanted, > 0, cloud units; made larger where the brick is so wide
    /// that
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
        double
            squared_distance;  ///< to the nearest point elsewhere that was found; may be infinite
        bool lowest_id;        ///< no point with the same coordinates has a lower id
        bool complete;         ///< both are certain; false: the search was given up
    };

    /// Nearest point with other coordinates. Gives up where that is far away or among very many,
    /// measured in voxels: a tree is cheaper then. Thread-safe.
    Nearest nearest_other(std::uint32_t index, std::span<const PointId> ids) const;

    /// Bytes a point that a grid takes, for planning.
    static constexpr std::uint64_t kBytesPerPoint = 24;

  private:
    struct Grid;
    std::span<const Vec3> points_;
    std::unique_ptr<Grid> grid_;
};

}  // namespace knap
