#include "store/brick_map.hpp"

#include <openvdb/openvdb.h>

#include <map>
#include <optional>

namespace knap {

namespace {

using Tree = openvdb::Int32Tree;
using Leaf = Tree::LeafNodeType;
using openvdb::Coord;
using openvdb::CoordBBox;

CoordBBox to_coords(const VoxelBox& box) {
    return {Coord(box.min.x, box.min.y, box.min.z), Coord(box.max.x, box.max.y, box.max.z)};
}

std::vector<VoxelBox> cores_of(const BrickPlan& plan) {
    std::vector<VoxelBox> cores;
    for (const Brick& brick : plan.bricks) {
        cores.push_back(brick.core);
    }
    return cores;
}

std::vector<VoxelBox> reaches_of(const BrickPlan& plan) {
    std::vector<VoxelBox> reaches;
    for (const Brick& brick : plan.bricks) {
        reaches.push_back(voxels_touched(brick, plan.voxel_size));
    }
    return reaches;
}

}  // namespace

struct BrickMap::Grid {
    double voxel_size = 0;
    Tree tree{-1};
    std::vector<std::uint32_t> bricks;  // the lists, one after the other
    std::vector<std::size_t> begin{0};  // list i is bricks[begin[i]] .. bricks[begin[i + 1]]
};

BrickMap::BrickMap(const Occupancy& occupancy, const BrickPlan& plan)
    : BrickMap(occupancy, cores_of(plan), reaches_of(plan)) {}

BrickMap::BrickMap(const Occupancy& occupancy, const std::vector<VoxelBox>& cores,
                   const std::vector<VoxelBox>& reaches)
    : grid_(std::make_unique<Grid>()) {
    grid_->voxel_size = occupancy.voxel_size();
    std::map<std::vector<std::uint32_t>, std::int32_t> known;
    std::vector<std::uint32_t> touching;
    std::vector<std::uint32_t> list;
    std::optional<Coord> last_block;
    openvdb::tree::ValueAccessor<Tree> values(grid_->tree);
    for (const Voxel& voxel : occupancy.voxels()) {
        // Voxels come leaf by leaf: the bricks that touch a leaf are found once.
        constexpr int kLeafLog2 = static_cast<int>(Leaf::LOG2DIM);
        const Coord block(voxel.at.x >> kLeafLog2, voxel.at.y >> kLeafLog2,
                          voxel.at.z >> kLeafLog2);
        if (last_block != block) {
            last_block = block;
            const Coord low(block.x() << kLeafLog2, block.y() << kLeafLog2, block.z() << kLeafLog2);
            const CoordBBox leaf(low, low.offsetBy(static_cast<int>(Leaf::DIM) - 1));
            touching.clear();
            for (std::size_t i = 0; i < reaches.size(); ++i) {
                if (leaf.hasOverlap(to_coords(reaches[i]))) {
                    touching.push_back(static_cast<std::uint32_t>(i));
                }
            }
        }
        list.clear();
        for (const std::uint32_t brick : touching) {
            if (cores[brick].contains(voxel.at)) {
                list.insert(list.begin(), brick);
            } else if (reaches[brick].contains(voxel.at)) {
                list.push_back(brick);
            }
        }
        const auto [entry, added] = known.emplace(list, static_cast<std::int32_t>(known.size()));
        if (added) {
            grid_->bricks.insert(grid_->bricks.end(), list.begin(), list.end());
            grid_->begin.push_back(grid_->bricks.size());
        }
        values.setValueOn(Coord(voxel.at.x, voxel.at.y, voxel.at.z), entry->second);
    }
}

BrickMap::~BrickMap() = default;
BrickMap::BrickMap(BrickMap&&) noexcept = default;

struct BrickMap::Reader::Accessor {
    explicit Accessor(const Grid& map) : grid(map), values(map.tree) {}
    const Grid& grid;
    openvdb::tree::ValueAccessor<const Tree> values;
};

BrickMap::Reader::Reader(const BrickMap& map) : accessor_(std::make_unique<Accessor>(*map.grid_)) {}
BrickMap::Reader::~Reader() = default;
BrickMap::Reader::Reader(Reader&&) noexcept = default;

std::span<const std::uint32_t> BrickMap::Reader::bricks_at(const Vec3& point) {
    const Grid& grid = accessor_->grid;
    // A source that has changed may hold points that no survey saw, as far away as they like.
    const VoxelCoord voxel = voxel_of(point, grid.voxel_size);
    const Coord at(voxel.x, voxel.y, voxel.z);
    const std::int32_t list = accessor_->values.getValue(at);
    if (list < 0) {
        return {};
    }
    const std::size_t begin = grid.begin[static_cast<std::size_t>(list)];
    const std::size_t end = grid.begin[static_cast<std::size_t>(list) + 1];
    return std::span(grid.bricks).subspan(begin, end - begin);
}

}  // namespace knap
