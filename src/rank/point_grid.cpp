#include "rank/point_grid.hpp"

#include <openvdb/openvdb.h>
#include <openvdb/tools/PointIndexGrid.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace knap {

namespace {

using IndexGrid = openvdb::tools::PointIndexGrid;
using IndexTree = IndexGrid::TreeType;
using openvdb::Coord;

// Voxels along the longest side of a brick: within the reach of 32-bit coordinates, and coarse
// enough that the rounding of a voxel's faces is far below kFaceMargin.
constexpr double kMostVoxels = 1 << 20;
constexpr double kFaceMargin = 1 - 1e-6;

// Where a search gives up: voxels away, and points looked at.
constexpr int kWidestRing = 6;
constexpr std::ptrdiff_t kMostCandidates = 4096;

// Puts a brick at the origin and makes its voxels unit cubes: OpenVDB's transforms refuse voxels
// below 1e-7 or so, whatever the cloud's unit is.
struct Placement {
    Vec3 origin;
    double voxel_size = 1;

    openvdb::Vec3d operator()(const Vec3& point) const {
        const Vec3 p = point - origin;
        return {p.x / voxel_size, p.y / voxel_size, p.z / voxel_size};
    }
};

// The brick as PointIndexGrid wants it.
class PointList {
  public:
    using PosType = openvdb::Vec3d;

    PointList(std::span<const Vec3> points, const Placement& placement)
        : points_(points), placement_(placement) {}
    std::size_t size() const { return points_.size(); }
    // NOLINTNEXTLINE(readability-identifier-naming): the name is OpenVDB's.
    void getPos(std::size_t n, PosType& position) const { position = placement_(points_[n]); }

  private:
    std::span<const Vec3> points_;
    Placement placement_;
};

/// Calls visit(voxel) for the surface of a cube of voxels; ring 0 is the voxel in the middle.
template <typename Visit>
void visit_ring(const Coord& centre, int ring, const Visit& visit) {
    for (int dx = -ring; dx <= ring; ++dx) {
        for (int dy = -ring; dy <= ring; ++dy) {
            const bool side = std::abs(dx) == ring || std::abs(dy) == ring;
            const int step = side || ring == 0 ? 1 : 2 * ring;
            for (int dz = -ring; dz <= ring; dz += step) {
                visit(centre.offsetBy(dx, dy, dz));
            }
        }
    }
}

}  // namespace

struct PointGrid::Grid {
    Placement placement;
    IndexGrid::Ptr index;

    Coord voxel_of(const Vec3& point) const {
        return index->transform().worldToIndexCellCentered(placement(point));
    }
};

PointGrid::PointGrid(std::span<const Vec3> points, double voxel_size)
    : points_(points), grid_(std::make_unique<Grid>()) {
    Box box;
    for (const Vec3& p : points) {
        box.extend(p);
    }
    const Vec3 size = box.size();
    const double longest = std::max({size.x, size.y, size.z});
    grid_->placement.origin = box.empty() ? Vec3{} : box.min;
    grid_->placement.voxel_size =
        std::max({voxel_size, longest / kMostVoxels, std::numeric_limits<float>::min() * 1.0});
    // Isolated: a thread that waits inside the library must not start on another brick.
    tbb::this_task_arena::isolate([&] {
        const auto transform = openvdb::math::Transform::createLinearTransform(1.0);
        grid_->index = openvdb::tools::createPointIndexGrid<IndexGrid>(
            PointList(points, grid_->placement), *transform);
    });
}

PointGrid::~PointGrid() = default;

std::vector<std::uint32_t> PointGrid::order(std::vector<std::uint32_t>& begins) const {
    std::vector<std::uint32_t> order;
    order.reserve(points_.size());
    begins.clear();
    for (auto leaf = grid_->index->tree().cbeginLeaf(); leaf; ++leaf) {
        for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel) {
            const openvdb::PointIndex32* begin = nullptr;
            const openvdb::PointIndex32* end = nullptr;
            leaf->getIndices(voxel.pos(), begin, end);
            if (begin == end) {
                continue;
            }
            begins.push_back(static_cast<std::uint32_t>(order.size()));
            const std::size_t first = order.size();
            order.insert(order.end(), begin, end);
            std::sort(order.begin() + static_cast<std::ptrdiff_t>(first), order.end());
        }
    }
    return order;
}

PointGrid::Nearest PointGrid::nearest_other(std::uint32_t index,
                                            std::span<const PointId> ids) const {
    openvdb::tree::ValueAccessor<const IndexTree> leaves(grid_->index->tree());
    const Vec3 p = points_[index];
    const Coord centre = grid_->voxel_of(p);
    Nearest found{std::numeric_limits<double>::infinity(), true, false};
    std::ptrdiff_t candidates = 0;
    const auto visit = [&](const Coord& at) {
        const auto* leaf = leaves.probeConstLeaf(at);
        const openvdb::PointIndex32* begin = nullptr;
        const openvdb::PointIndex32* end = nullptr;
        if (leaf == nullptr || !leaf->getIndices(at, begin, end)) {
            return;
        }
        candidates += end - begin;
        for (; begin != end && candidates <= kMostCandidates; ++begin) {
            const Vec3& q = points_[*begin];
            if (q == p) {
                found.lowest_id = found.lowest_id && ids[*begin] >= ids[index];
            } else {
                found.squared_distance = std::min(found.squared_distance, squared_distance(p, q));
            }
        }
    };
    for (int ring = 0; ring <= kWidestRing && candidates <= kMostCandidates; ++ring) {
        visit_ring(centre, ring, visit);
        // Points outside the cube are at least `ring` whole voxels away.
        const double safe = ring * grid_->placement.voxel_size * kFaceMargin;
        if (found.squared_distance < safe * safe && candidates <= kMostCandidates) {
            found.complete = true;
            break;
        }
    }
    return found;
}

}  // namespace knap
