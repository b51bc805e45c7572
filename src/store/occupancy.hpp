#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "knap/geometry.hpp"

namespace knap {

/// Integer coordinates of a voxel: it holds the points p with floor(p / voxel_size) == (x, y, z).
struct VoxelCoord {
    std::int32_t x = 0;
    std::int32_t y = 0;
    std::int32_t z = 0;

    std::int32_t& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
    std::int32_t operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
    friend bool operator==(const VoxelCoord&, const VoxelCoord&) = default;
};

/// An occupied voxel.
struct Voxel {
    VoxelCoord at;
    std::uint32_t points = 0;  ///< > 0; stays at 2^31 - 1 beyond that
};

/// A box of voxels, both ends included.
struct VoxelBox {
    VoxelCoord min;
    VoxelCoord max;

    bool contains(const VoxelCoord& v) const {
        return v.x >= min.x && v.x <= max.x && v.y >= min.y && v.y <= max.y && v.z >= min.z &&
               v.z <= max.z;
    }
    friend bool operator==(const VoxelBox&, const VoxelBox&) = default;
};

/// Index of the voxel that holds a coordinate, before it is cut to 32 bits. Monotone in
/// `coordinate`: voxel sizes are powers of two, so that the division is exact.
double voxel_index(double coordinate, double voxel_size);

/// The voxel that holds a point; far beyond all voxels for points as far away.
VoxelCoord voxel_of(const Vec3& point, double voxel_size);

/// How many points lie in each voxel of an archive: a sparse OpenVDB grid.
///
/// Voxel sizes are powers of two, so that a coarser grid's voxels are unions of a finer one's. The
/// grid coarsens itself whenever it would outgrow its budget; since a tree only grows as points
/// are added, the voxel size in the end depends on the points and the budget, not on their order.
class Occupancy {
  public:
    /// @param voxel_size    smallest voxel size wanted, rounded down to a power of two, > 0, cloud
    /// units
    /// @param budget_bytes  memory that the grid may take
    Occupancy(double voxel_size, std::uint64_t budget_bytes);

    /// A grid that was taken apart by voxels().
    /// @param voxel_size  a power of two
    Occupancy(double voxel_size, std::span<const Voxel> voxels);
    ~Occupancy();
    Occupancy(Occupancy&&) noexcept;
    Occupancy& operator=(Occupancy&&) noexcept;

    /// Counts a finite point. Not thread-safe.
    void add(const Vec3& point);

    /// Adds the counts of another grid of the same budget and first voxel size.
    void add(const Occupancy& other);

    /// Edge of a voxel, cloud units, a power of two.
    double voxel_size() const;

    std::uint64_t voxel_count() const;
    std::uint64_t memory_bytes() const;

    /// All occupied voxels in the order of the tree, the same for the same set of points.
    std::vector<Voxel> voxels() const;

    /// Occupied voxels of a box, in the order of the tree. Thread-safe.
    void for_each_in(const VoxelBox& box, const std::function<void(const Voxel&)>& visit) const;

    /// Points in the cube of voxels within `ring` steps of `centre`, and the number of occupied
    /// voxels among them. Thread-safe.
    struct Around {
        std::uint64_t points = 0;
        std::uint64_t voxels = 0;
    };
    Around around(const VoxelCoord& centre, int ring) const;

  private:
    struct Grid;
    std::unique_ptr<Grid> grid_;
};

}  // namespace knap
