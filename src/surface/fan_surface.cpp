#include "surface/fan_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "curvature/neighbourhoods.hpp"
#include "curvature/principal_axes.hpp"
#include "knap/error.hpp"
#include "surface/triangle.hpp"

namespace knap {

namespace {

// Neighbours that a fan is made of: twice as many until no farther one could change it, or, on a
// border, the most.
constexpr std::size_t kNeighbours = 20;
constexpr std::size_t kMostNeighbours = 160;
// Fans that a point is held against: the nearest facet belongs to one of them but where edges are
// very uneven.
constexpr std::size_t kFans = 8;

/// A neighbour in the plane of a fan, inverted at the unit circle round the centre.
struct Inverted {
    double x = 0;
    double y = 0;
    std::uint32_t index = 0;
};

double turn(const Inverted& a, const Inverted& b, const Inverted& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Counterclockwise, by Andrew's monotone chain.
std::vector<Inverted> convex_hull(std::vector<Inverted> points) {
    std::sort(points.begin(), points.end(), [](const Inverted& a, const Inverted& b) {
        return a.x < b.x || (a.x == b.x && a.y < b.y);
    });
    std::vector<Inverted> hull;
    const auto walk = [&](auto first, auto last) {
        const std::size_t begin = hull.size();
        for (; first != last; ++first) {
            while (hull.size() >= begin + 2 &&
                   turn(hull[hull.size() - 2], hull.back(), *first) <= 0) {
                hull.pop_back();
            }
            hull.push_back(*first);
        }
        hull.pop_back();
    };
    if (points.size() < 2) {
        return points;
    }
    walk(points.begin(), points.end());
    walk(points.rbegin(), points.rend());
    return hull;
}

Neighbourhoods neighbourhood_of(const std::vector<Vec3>& points, std::size_t i,
                                const std::vector<Neighbour>& neighbours) {
    Neighbourhoods alone;
    alone.resize(1, neighbours.size() + 1);
    const auto put = [&](std::size_t place, const Vec3& p) {
        alone.x[place] = p.x;
        alone.y[place] = p.y;
        alone.z[place] = p.z;
    };
    put(0, {});
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
        put(k + 1, points[neighbours[k].index] - points[i]);
    }
    return alone;
}

// The neighbours in the plane of all of them, inverted.
std::vector<Inverted> invert(const std::vector<Vec3>& points, std::size_t i,
                             const std::vector<Neighbour>& neighbours) {
    std::vector<Inverted> inverted;
    const Neighbourhoods alone = neighbourhood_of(points, i, neighbours);
    PrincipalAxes axes;
    find_principal_axes(alone, axes);
    if (!(axes.largest[0] > 0)) {
        return inverted;
    }
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
        const auto along = [&](PrincipalAxes::Axis axis) {
            const auto& rows = axes.axes[axis];
            return alone.x[k + 1] * rows[0][0] + alone.y[k + 1] * rows[1][0] +
                   alone.z[k + 1] * rows[2][0];
        };
        const double x = along(PrincipalAxes::kFirst);
        const double y = along(PrincipalAxes::kSecond);
        const double squared = x * x + y * y;
        // Straight above or below the point: on another sheet.
        constexpr double kSteep = 1e-6;
        if (squared > kSteep * neighbours[k].squared_distance) {
            inverted.push_back({x / squared, y / squared, neighbours[k].index});
        }
    }
    return inverted;
}

// The Delaunay neighbours of a point are the corners of the convex hull of the others, inverted at
// a circle round it: a circle through the point becomes a line. Returns whether the fan is closed
// and none of its triangles has a circumcircle that reaches beyond the neighbours.
bool make_fan(const std::vector<Vec3>& points, std::size_t i,
              const std::vector<Neighbour>& neighbours, std::vector<std::uint32_t>& rim) {
    const std::vector<Inverted> hull = convex_hull(invert(points, i, neighbours));
    if (hull.size() < 2) {
        return false;
    }
    bool certain = hull.size() > 2;
    const double reach_squared = neighbours.back().squared_distance;
    for (std::size_t k = 0; k < hull.size(); ++k) {
        const Inverted& a = hull[k];
        const Inverted& b = hull[(k + 1) % hull.size()];
        const double area = a.x * b.y - a.y * b.x;
        const double edge_squared = (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
        // The line is 1 / diameter away. An edge that has the point on its other side closes the
        // fan of a border.
        certain = certain && area > 0 && area * area * reach_squared >= edge_squared;
        if (area > 0) {
            rim.push_back(a.index);
            rim.push_back(b.index);
        }
    }
    return certain;
}

}  // namespace

FanSurface::FanSurface(std::vector<Vec3> points)
    : FanSurface(std::move(points), {}, std::numeric_limits<double>::infinity()) {}

FanSurface::FanSurface(std::vector<Vec3> points, std::vector<PointId> ids, double farthest)
    : points_(std::move(points)), ids_(std::move(ids)), farthest_(farthest) {
    if (points_.empty()) {
        throw ConfigError("evaluate: expected a simplified cloud with points, found none");
    }
    if (ids_.empty()) {
        ids_.resize(points_.size());
        std::iota(ids_.begin(), ids_.end(), PointId{0});
    }
    search_ = std::make_unique<NeighbourSearch>(points_, ids_);
    made_ = std::vector<std::once_flag>(points_.size());
    fans_.resize(points_.size());
}

const FanSurface::Fan& FanSurface::fan_of(std::uint32_t centre) const {
    std::call_once(made_[centre], [&] { fans_[centre] = make(centre); });
    return fans_[centre];
}

FanSurface::Fan FanSurface::make(std::uint32_t centre) const {
    thread_local std::vector<Neighbour> neighbours;
    Fan fan;
    fan.reach = farthest_;
    for (std::size_t k = kNeighbours; k <= kMostNeighbours; k *= 2) {
        search_->nearest(points_[centre], ids_[centre], k, neighbours, farthest_ * farthest_);
        if (neighbours.empty()) {
            break;
        }
        fan.rim.clear();
        const bool certain = make_fan(points_, centre, neighbours, fan.rim);
        if (neighbours.size() < k) {
            break;
        }
        if (certain || 2 * k > kMostNeighbours) {
            fan.reach = std::sqrt(neighbours.back().squared_distance);
            break;
        }
    }
    return fan;
}

Surface::Nearest FanSurface::nearest(const Vec3& p, double enough) const {
    constexpr PointId kNoPoint = std::numeric_limits<PointId>::max();
    thread_local std::vector<Neighbour> near;
    search_->nearest(p, kNoPoint, kFans, near, farthest_ * farthest_);
    if (near.empty()) {
        return {.distance = std::numeric_limits<double>::infinity(), .reach = farthest_};
    }
    const double enough_squared = enough < 0 ? -1 : enough * enough;
    double best = near.front().squared_distance;
    double reach = std::sqrt(best);
    for (std::size_t at = 0; at < near.size() && best > enough_squared; ++at) {
        const std::uint32_t centre = near[at].index;
        const Fan& fan = fan_of(centre);
        for (std::size_t of = 0; of < fan.rim.size(); of += 2) {
            best = std::min(best,
                            squared_distance_to_triangle(p, points_[centre], points_[fan.rim[of]],
                                                         points_[fan.rim[of + 1]]));
        }
        reach = std::max(reach, std::sqrt(near[at].squared_distance) + fan.reach);
    }
    if (best > enough_squared) {
        reach = std::max(reach,
                         near.size() < kFans ? farthest_ : std::sqrt(near.back().squared_distance));
    }
    return {.distance = std::sqrt(best), .reach = reach};
}

}  // namespace knap
