#include "plan/plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>
#include <vector>

namespace knap {

namespace {

// Voxels of a brick that are looked at to find how far its neighbourhoods reach.
constexpr std::size_t kReachSamples = 256;
// The halo serves this share of the sampled voxels; the rest are stragglers.
constexpr double kServedShare = 0.98;
// Widest ring of voxels that is searched for K points; beyond it a point is a straggler.
constexpr int kWidestRing = 8;
// Neighbourhoods at an edge or where density falls reach farther than on an even surface.
constexpr double kReachMargin = 1.5;
// Faces among which the one that halves a brick is chosen.
constexpr std::int64_t kMostBins = 4096;

VoxelBox bounds_of(std::span<const Voxel> voxels) {
    VoxelBox box{voxels.front().at, voxels.front().at};
    for (const Voxel& voxel : voxels) {
        for (int axis = 0; axis < 3; ++axis) {
            box.min[axis] = std::min(box.min[axis], voxel.at[axis]);
            box.max[axis] = std::max(box.max[axis], voxel.at[axis]);
        }
    }
    return box;
}

std::uint64_t points_in(std::span<const Voxel> voxels) {
    return std::accumulate(
        voxels.begin(), voxels.end(), std::uint64_t{0},
        [](std::uint64_t sum, const Voxel& voxel) { return sum + voxel.points; });
}

class Planner {
  public:
    Planner(const Occupancy& occupancy, const Box& box, const PlanRequest& request)
        : occupancy_(occupancy), box_(box), request_(request) {
        plan_.voxel_size = occupancy.voxel_size();
    }

    BrickPlan plan() {
        std::vector<Voxel> voxels = occupancy_.voxels();
        if (!voxels.empty()) {
            split(voxels);
        }
        return std::move(plan_);
    }

  private:
    void split(std::span<Voxel> voxels) {
        const VoxelBox bounds = bounds_of(voxels);
        const std::uint64_t points = points_in(voxels);
        const bool splittable = voxels.size() > 1;
        if (points <= request_.target_points || !splittable) {
            const Brick brick = make_brick(voxels, bounds, points);
            if (brick.core_points + brick.halo_points <= request_.most_points || !splittable) {
                plan_.bricks.push_back(brick);
                return;
            }
        }
        const std::size_t middle = split_at_median(voxels, bounds, points);
        split(voxels.first(middle));
        split(voxels.subspan(middle));
    }

    // Puts the voxels before the face across the longest axis that halves the points best in
    // front, and returns how many they are. Both sides are non-empty: the outermost bins are.
    static std::size_t split_at_median(std::span<Voxel> voxels, const VoxelBox& bounds,
                                       std::uint64_t points) {
        int axis = 0;
        const auto extent = [&](int of) {
            return static_cast<std::int64_t>(bounds.max[of]) - bounds.min[of] + 1;
        };
        for (int candidate = 1; candidate < 3; ++candidate) {
            if (extent(candidate) > extent(axis)) {
                axis = candidate;
            }
        }
        const std::int64_t bins = std::min(extent(axis), kMostBins);
        const auto bin_of = [&](const Voxel& voxel) {
            return static_cast<std::size_t>((voxel.at[axis] - std::int64_t{bounds.min[axis]}) *
                                            bins / extent(axis));
        };
        std::vector<std::uint64_t> histogram(static_cast<std::size_t>(bins));
        for (const Voxel& voxel : voxels) {
            histogram[bin_of(voxel)] += voxel.points;
        }
        std::size_t last_in_front = 0;
        std::uint64_t best = std::numeric_limits<std::uint64_t>::max();
        std::uint64_t before = 0;
        for (std::size_t bin = 0; bin + 1 < histogram.size(); ++bin) {
            before += histogram[bin];
            const std::uint64_t after = points - before;
            const std::uint64_t distance = before > after ? before - after : after - before;
            if (distance < best) {
                best = distance;
                last_in_front = bin;
            }
        }
        const auto middle = std::partition(voxels.begin(), voxels.end(), [&](const Voxel& voxel) {
            return bin_of(voxel) <= last_in_front;
        });
        return static_cast<std::size_t>(middle - voxels.begin());
    }

    // Distance within which a point of this voxel finds K others, read off the occupancy.
    double reach_of(const Voxel& voxel) const {
        const double edge = plan_.voxel_size;
        const auto wanted = static_cast<std::uint64_t>(request_.neighbours) + 1;
        for (int ring = 1; ring <= kWidestRing; ring *= 2) {
            const Occupancy::Around around = occupancy_.around(voxel.at, ring);
            if (around.points >= 2 * wanted) {
                // A surface with this many points a voxel face.
                const double density = static_cast<double>(around.points) /
                                       (static_cast<double>(around.voxels) * edge * edge);
                return kReachMargin *
                       std::sqrt(static_cast<double>(wanted) / (std::numbers::pi * density));
            }
        }
        return (kWidestRing + 1) * edge;
    }

    double halo_width(std::span<const Voxel> voxels) const {
        const std::size_t step = std::max<std::size_t>(1, voxels.size() / kReachSamples);
        std::vector<double> reaches;
        for (std::size_t i = 0; i < voxels.size(); i += step) {
            reaches.push_back(reach_of(voxels[i]));
        }
        const auto at =
            static_cast<std::size_t>(kServedShare * static_cast<double>(reaches.size() - 1));
        std::nth_element(reaches.begin(), reaches.begin() + static_cast<std::ptrdiff_t>(at),
                         reaches.end());
        return reaches[at];
    }

    // Points of voxels outside the core, each by the part of it that the halo covers.
    std::uint64_t points_in_halo(const Brick& brick) const {
        const double edge = plan_.voxel_size;
        double points = 0;
        occupancy_.for_each_in(voxels_touched(brick, edge), [&](const Voxel& voxel) {
            if (brick.core.contains(voxel.at)) {
                return;
            }
            double part = 1;
            for (int axis = 0; axis < 3; ++axis) {
                const double low = voxel.at[axis] * edge;
                const double covered = std::min(brick.halo.max[axis], low + edge) -
                                       std::max(brick.halo.min[axis], low);
                part *= std::clamp(covered / edge, 0.0, 1.0);
            }
            points += part * voxel.points;
        });
        return static_cast<std::uint64_t>(std::ceil(points));
    }

    Brick make_brick(std::span<const Voxel> voxels, const VoxelBox& core,
                     std::uint64_t points) const {
        const double edge = plan_.voxel_size;
        Brick brick;
        brick.core = core;
        brick.core_points = points;
        double width = halo_width(voxels);
        for (;;) {
            for (int axis = 0; axis < 3; ++axis) {
                brick.halo.min[axis] = std::max(core.min[axis] * edge - width, box_.min[axis]);
                brick.halo.max[axis] =
                    std::min((core.max[axis] + 1.0) * edge + width, box_.max[axis]);
            }
            brick.halo_points = points_in_halo(brick);
            // A brick of one voxel cannot be made smaller, but its halo can: the points that it
            // then does not serve are stragglers.
            if (voxels.size() > 1 || brick.halo_points == 0 ||
                brick.core_points + brick.halo_points <= request_.most_points ||
                width < edge / 1024) {
                break;
            }
            width /= 2;
        }
        return brick;
    }

    const Occupancy& occupancy_;
    Box box_;
    PlanRequest request_;
    BrickPlan plan_;
};

}  // namespace

BrickPlan plan_bricks(const Occupancy& occupancy, const Box& box, const PlanRequest& request) {
    return Planner(occupancy, box, request).plan();
}

}  // namespace knap
