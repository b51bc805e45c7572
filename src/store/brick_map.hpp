#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "store/brick_plan.hpp"
#include "store/occupancy.hpp"

namespace knap {

/// Which bricks each voxel of the archive belongs to: a sparse OpenVDB grid of indices into a
/// table of brick lists.
class BrickMap {
  public:
    /// @param occupancy  the voxels of the archive
    /// @param cores      voxels that a brick owns; every occupied voxel is in exactly one
    /// @param reaches    voxels that a brick's core and halo touch; each contains the core
    BrickMap(const Occupancy& occupancy, const std::vector<VoxelBox>& cores,
             const std::vector<VoxelBox>& reaches);
    /// The bricks of a plan.
    BrickMap(const Occupancy& occupancy, const BrickPlan& plan);
    ~BrickMap();
    BrickMap(BrickMap&&) noexcept;

    /// Looks voxels up; keeps the path to the last one, so that neighbours are cheap. One a thread.
    class Reader {
      public:
        explicit Reader(const BrickMap& map);
        ~Reader();
        Reader(Reader&&) noexcept;

        /// Bricks that the voxel of a point belongs to, its owner first; empty if the voxel is not
        /// occupied.
        std::span<const std::uint32_t> bricks_at(const Vec3& point);

      private:
        struct Accessor;
        std::unique_ptr<Accessor> accessor_;
    };

  private:
    struct Grid;
    std::unique_ptr<Grid> grid_;
};

}  // namespace knap
