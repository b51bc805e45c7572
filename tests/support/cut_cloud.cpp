#include "support/cut_cloud.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "plan/plan.hpp"

namespace knap::test {

namespace {

constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();
constexpr std::uint64_t kGridBytes = std::uint64_t{16} << 20;

bool owns(const Brick& brick, const Vec3& p, double voxel_size) {
    VoxelCoord voxel;
    for (int axis = 0; axis < 3; ++axis) {
        voxel[axis] = static_cast<std::int32_t>(std::floor(p[axis] / voxel_size));
    }
    return brick.core.contains(voxel);
}

}  // namespace

Points finite_points(std::span<const Vec3> cloud) {
    Points points;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
        if (is_finite(cloud[i])) {
            points.positions.push_back(cloud[i]);
            points.ids.push_back(i);
            points.box.extend(cloud[i]);
        }
    }
    return points;
}

Points distinct_points(std::span<const Vec3> cloud) {
    const Points all = finite_points(cloud);
    Points points;
    points.box = all.box;
    std::set<std::array<double, 3>> seen;
    for (std::size_t i = 0; i < all.ids.size(); ++i) {
        const Vec3& p = all.positions[i];
        if (seen.insert({p.x, p.y, p.z}).second) {
            points.positions.push_back(p);
            points.ids.push_back(all.ids[i]);
        }
    }
    return points;
}

Occupancy occupancy_of(const Points& points, double voxels) {
    const Vec3 size = points.box.size();
    const double longest = std::max({size.x, size.y, size.z});
    Occupancy occupancy(longest > 0 ? longest / voxels : 1, kGridBytes);
    for (const Vec3& p : points.positions) {
        occupancy.add(p);
    }
    return occupancy;
}

CutCloud cut_cloud(std::mt19937_64& random, const Points& points, std::uint64_t brick_points,
                   Halo halo) {
    constexpr double kVoxels = 60;
    const BrickPlan plan =
        plan_bricks(occupancy_of(points, kVoxels), points.box,
                    {.neighbours = 30, .target_points = brick_points, .most_points = kNoLimit});
    CutCloud cut{points.box, {}};
    for (const Brick& planned : plan.bricks) {
        CutBrick brick{planned, {}, {}};
        std::vector<std::size_t> core;
        std::vector<std::size_t> others;
        for (std::size_t i = 0; i < points.ids.size(); ++i) {
            const bool own = owns(planned, points.positions[i], plan.voxel_size);
            (own ? core : others).push_back(i);
            if (own) {
                brick.core_box.extend(points.positions[i]);
            }
        }
        brick.brick.halo = halo == Halo::kAll    ? points.box
                           : halo == Halo::kNone ? brick.core_box
                                                 : planned.halo;
        std::erase_if(
            others, [&](std::size_t i) { return !brick.brick.halo.contains(points.positions[i]); });
        std::shuffle(core.begin(), core.end(), random);
        std::shuffle(others.begin(), others.end(), random);
        brick.points.core_count = core.size();
        core.insert(core.end(), others.begin(), others.end());
        for (const std::size_t i : core) {
            brick.points.positions.push_back(points.positions[i]);
            brick.points.ids.push_back(points.ids[i]);
        }
        cut.bricks.push_back(std::move(brick));
    }
    return cut;
}

std::vector<Found> nearest_by_force(const Points& points, const Vec3& query, PointId self,
                                    std::size_t k, double max_squared) {
    std::vector<Found> found;
    for (std::size_t i = 0; i < points.ids.size(); ++i) {
        const double squared = squared_distance(query, points.positions[i]);
        if (points.ids[i] != self && squared <= max_squared) {
            found.push_back({squared, points.ids[i]});
        }
    }
    const std::size_t count = std::min(k, found.size());
    std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count),
                      found.end());
    found.resize(count);
    return found;
}

}  // namespace knap::test
