#include "store/occupancy.hpp"

#include <openvdb/openvdb.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace knap {

namespace {

using Tree = openvdb::Int32Tree;
using Upper = Tree::RootNodeType::ChildNodeType;
using Lower = Upper::ChildNodeType;
using Leaf = Tree::LeafNodeType;
using openvdb::Coord;
using openvdb::CoordBBox;

// Half the range of a tree's coordinates, so that boxes around a voxel stay inside it.
constexpr double kLargestIndex = 1 << 30;
constexpr std::int32_t kMostPoints = std::numeric_limits<std::int32_t>::max();

// A dense surface is all leaves; far outliers have a node of 256 KiB each.
constexpr std::uint64_t kLeafBytes = sizeof(Leaf) + Leaf::SIZE * sizeof(std::int32_t);
constexpr std::uint64_t kLowerBytes = sizeof(Lower);
constexpr std::uint64_t kUpperBytes = sizeof(Upper);

// A cloud about the origin has voxels on both sides of every axis, however large they are.
constexpr std::uint64_t kLeastBytes = 8 * (kLeafBytes + kLowerBytes + kUpperBytes);

double power_of_two_below(double value) {
    int exponent = 0;
    std::frexp(value, &exponent);
    return std::ldexp(1.0, exponent - 1);
}

VoxelCoord to_voxel(const Coord& c) {
    return {c.x(), c.y(), c.z()};
}

Coord to_coord(const VoxelCoord& v) {
    return {v.x, v.y, v.z};
}

std::int32_t saturated_sum(std::int32_t a, std::int32_t b) {
    return a > kMostPoints - b ? kMostPoints : a + b;
}

}  // namespace

double voxel_index(double coordinate, double voxel_size) {
    return std::floor(coordinate / voxel_size);
}

VoxelCoord voxel_of(const Vec3& point, double voxel_size) {
    const auto index = [&](double coordinate) {
        constexpr double kLimit = 0x1p31 - 1;
        return static_cast<std::int32_t>(
            std::clamp(voxel_index(coordinate, voxel_size), -kLimit, kLimit));
    };
    return {index(point.x), index(point.y), index(point.z)};
}

struct Occupancy::Grid {
    double voxel_size;
    std::uint64_t most_bytes;
    std::unique_ptr<Tree> tree = std::make_unique<Tree>(0);
    std::optional<openvdb::tree::ValueAccessor<Tree>> accessor;
    std::uint64_t bytes = 0;

    Grid(double size, std::uint64_t budget_bytes)
        : voxel_size(power_of_two_below(size)), most_bytes(std::max(budget_bytes, kLeastBytes)) {
        accessor.emplace(*tree);
    }

    void add(const Coord& at, std::int32_t points) {
        Leaf* leaf = accessor->probeLeaf(at);
        if (leaf == nullptr) {
            bytes += kLeafBytes;
            bytes += accessor->probeNode<Lower>(at) == nullptr ? kLowerBytes : 0;
            bytes += accessor->probeNode<Upper>(at) == nullptr ? kUpperBytes : 0;
            leaf = accessor->touchLeaf(at);
        }
        const openvdb::Index offset = Leaf::coordToOffset(at);
        leaf->setValueOn(offset, saturated_sum(leaf->getValue(offset), points));
    }

    void coarsen_to_budget() {
        while (bytes > most_bytes) {
            coarsen();
        }
    }

    void coarsen() {
        std::unique_ptr<Tree> fine = std::move(tree);
        accessor.reset();
        tree = std::make_unique<Tree>(0);
        accessor.emplace(*tree);
        bytes = 0;
        voxel_size *= 2;
        // An arithmetic shift halves towards minus infinity, as floor() does.
        for (auto it = fine->cbeginValueOn(); it; ++it) {
            const Coord c = it.getCoord();
            add(Coord(c.x() >> 1, c.y() >> 1, c.z() >> 1), *it);
        }
    }

    void coarsen_until(double size) {
        while (voxel_size < size) {
            coarsen();
        }
    }
};

Occupancy::Occupancy(double voxel_size, std::uint64_t budget_bytes)
    : grid_(std::make_unique<Grid>(voxel_size, budget_bytes)) {}
Occupancy::Occupancy(double voxel_size, std::span<const Voxel> voxels)
    : grid_(std::make_unique<Grid>(voxel_size, std::numeric_limits<std::uint64_t>::max())) {
    for (const Voxel& voxel : voxels) {
        grid_->add(to_coord(voxel.at), static_cast<std::int32_t>(voxel.points));
    }
}
Occupancy::~Occupancy() = default;
Occupancy::Occupancy(Occupancy&&) noexcept = default;
Occupancy& Occupancy::operator=(Occupancy&&) noexcept = default;

void Occupancy::add(const Vec3& point) {
    std::array<double, 3> index{};
    for (int axis = 0; axis < 3; ++axis) {
        index[static_cast<std::size_t>(axis)] = voxel_index(point[axis], grid_->voxel_size);
        while (std::abs(index[static_cast<std::size_t>(axis)]) >= kLargestIndex) {
            grid_->coarsen();
            axis = 0;
            index[0] = voxel_index(point[0], grid_->voxel_size);
        }
    }
    grid_->add(
        Coord(static_cast<int>(index[0]), static_cast<int>(index[1]), static_cast<int>(index[2])),
        1);
    grid_->coarsen_to_budget();
}

void Occupancy::add(const Occupancy& other) {
    grid_->coarsen_until(other.grid_->voxel_size);
    int shift = 0;
    for (double size = other.grid_->voxel_size; size < grid_->voxel_size; size *= 2) {
        ++shift;
    }
    for (auto it = other.grid_->tree->cbeginValueOn(); it; ++it) {
        const Coord c = it.getCoord();
        grid_->add(Coord(c.x() >> shift, c.y() >> shift, c.z() >> shift), *it);
    }
    grid_->coarsen_to_budget();
}

double Occupancy::voxel_size() const {
    return grid_->voxel_size;
}

std::uint64_t Occupancy::voxel_count() const {
    return grid_->tree->activeVoxelCount();
}

std::uint64_t Occupancy::memory_bytes() const {
    return grid_->bytes;
}

std::vector<Voxel> Occupancy::voxels() const {
    std::vector<Voxel> all;
    all.reserve(grid_->tree->activeVoxelCount());
    for (auto it = grid_->tree->cbeginValueOn(); it; ++it) {
        all.push_back({to_voxel(it.getCoord()), static_cast<std::uint32_t>(*it)});
    }
    return all;
}

void Occupancy::for_each_in(const VoxelBox& box,
                            const std::function<void(const Voxel&)>& visit) const {
    const CoordBBox wanted(to_coord(box.min), to_coord(box.max));
    for (auto leaf = grid_->tree->cbeginLeaf(); leaf; ++leaf) {
        const CoordBBox bounds = leaf->getNodeBoundingBox();
        if (!wanted.hasOverlap(bounds)) {
            continue;
        }
        for (auto it = leaf->cbeginValueOn(); it; ++it) {
            const Coord c = it.getCoord();
            if (wanted.isInside(c)) {
                visit({to_voxel(c), static_cast<std::uint32_t>(*it)});
            }
        }
    }
}

Occupancy::Around Occupancy::around(const VoxelCoord& centre, int ring) const {
    openvdb::tree::ValueAccessor<const Tree> values(*grid_->tree);
    Around sum;
    for (int dx = -ring; dx <= ring; ++dx) {
        for (int dy = -ring; dy <= ring; ++dy) {
            for (int dz = -ring; dz <= ring; ++dz) {
                const std::int32_t points =
                    values.getValue(Coord(centre.x + dx, centre.y + dy, centre.z + dz));
                sum.points += static_cast<std::uint64_t>(points);
                sum.voxels += points > 0 ? 1 : 0;
            }
        }
    }
    return sum;
}

}  // namespace knap
