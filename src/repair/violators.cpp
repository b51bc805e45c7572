#include "repair/violators.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "base/threads.hpp"
#include "surface/fan_surface.hpp"

namespace knap {

namespace {

constexpr std::size_t kGrain = 1024;
// Far above the rounding of a reach.
constexpr double kPadding = 1 + 1e-9;

FanSurface surface_through(const std::vector<RankedPoint>& kept, double farthest) {
    std::vector<Vec3> positions;
    std::vector<PointId> ids;
    positions.reserve(kept.size());
    ids.reserve(kept.size());
    for (const RankedPoint& point : kept) {
        positions.push_back(point.position);
        ids.push_back(point.id);
    }
    return {std::move(positions), std::move(ids), farthest};
}

Box box_of(const std::vector<RankedPoint>& points) {
    Box box;
    for (const RankedPoint& point : points) {
        box.extend(point.position);
    }
    return box;
}

// Whether a distance holds whatever lies beyond a radius of the point.
bool is_certain(const Surface::Nearest& nearest, double radius) {
    return nearest.reach * kPadding <= radius;
}

}  // namespace

std::vector<RankedPoint> find_violators(std::vector<RankedPoint> points, const SurfaceLimit& limit,
                                        const KeptNear& kept_near) {
    std::vector<RankedPoint> violators;
    // No reach is longer than to a point and once more.
    const double largest = 2 * limit.farthest * kPadding * kPadding;
    for (double radius = limit.radius; !points.empty(); radius *= 2) {
        radius = std::min(radius, largest);
        const std::vector<RankedPoint> kept = kept_near(box_of(points), radius);
        std::vector<Surface::Nearest> found(
            points.size(),
            {.distance = std::numeric_limits<double>::infinity(), .reach = limit.farthest});
        if (!kept.empty()) {
            const FanSurface surface = surface_through(kept, limit.farthest);
            parallel_for(points.size(), kGrain, [&](std::size_t first, std::size_t last) {
                for (std::size_t i = first; i < last; ++i) {
                    found[i] = surface.nearest(points[i].position, limit.distance);
                }
            });
        }
        std::size_t left = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            if (!is_certain(found[i], radius) && radius < largest) {
                points[left++] = points[i];
            } else if (found[i].distance > limit.distance) {
                violators.push_back({found[i].distance, points[i].id, points[i].position});
            }
        }
        points.resize(left);
    }
    std::sort(violators.begin(), violators.end(),
              [](const RankedPoint& a, const RankedPoint& b) { return ranks_before(a, b); });
    return violators;
}

std::uint64_t violator_bytes_per_point() {
    return 2 * sizeof(RankedPoint) + sizeof(Surface::Nearest);
}

std::uint64_t violator_bytes_per_kept() {
    return 2 * sizeof(RankedPoint) + FanSurface::kBytesPerPoint;
}

}  // namespace knap
