#include "emit/tiles.hpp"

#include <algorithm>
#include <array>

#include "base/threads.hpp"

namespace knap {

namespace {

// Below this many points another thread costs more than it saves.
constexpr std::size_t kParallelPoints = 1 << 16;

template <typename Point>
LatticeBounds find_bounds(std::span<const Point> points) {
    if (points.empty()) {
        return {};
    }
    LatticeBounds bounds{place_of(points.front()), place_of(points.front())};
    for (const Point& point : points) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            bounds.min[axis] = std::min(bounds.min[axis], place_of(point)[axis]);
            bounds.max[axis] = std::max(bounds.max[axis], place_of(point)[axis]);
        }
    }
    return bounds;
}

template <typename Point>
void split(std::span<Point> points, std::size_t axis) {
    const auto middle = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2);
    std::nth_element(points.begin(), middle, points.end(), AlongAxis{axis});
}

template <typename Point>
std::vector<TileSpan> cut(std::span<Point> points, std::size_t first, std::uint64_t tile_points,
                          const std::function<void()>& poll) {
    poll();
    const LatticeBounds bounds = bounds_of(std::span<const Point>(points));
    if (points.size() <= tile_points && fits_tile(bounds)) {
        std::sort(points.begin(), points.end());
        return {{first, points.size(), bounds}};
    }
    split(points, longest_axis(bounds));
    const std::size_t half = points.size() / 2;
    std::array<std::vector<TileSpan>, 2> halves;
    const auto cut_half = [&](std::size_t i) {
        halves[i] = i == 0 ? cut(points.first(half), first, tile_points, poll)
                           : cut(points.subspan(half), first + half, tile_points, poll);
    };
    const auto cut_halves = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            cut_half(i);
        }
    };
    if (points.size() >= kParallelPoints) {
        parallel_for(2, 1, cut_halves);
    } else {
        cut_halves(0, 2);
    }
    halves[0].insert(halves[0].end(), halves[1].begin(), halves[1].end());
    return std::move(halves[0]);
}

}  // namespace

std::size_t longest_axis(const LatticeBounds& bounds) {
    std::size_t longest = 0;
    for (std::size_t axis = 1; axis < 3; ++axis) {
        if (bounds.max[axis] - bounds.min[axis] > bounds.max[longest] - bounds.min[longest]) {
            longest = axis;
        }
    }
    return longest;
}

LatticeBounds bounds_of(std::span<const LatticeIndex> points) {
    return find_bounds(points);
}

LatticeBounds bounds_of(std::span<const CarryingPoint> points) {
    return find_bounds(points);
}

bool fits_tile(const LatticeBounds& bounds) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (bounds.max[axis] - bounds.min[axis] >= std::int64_t{1} << kTileBits) {
            return false;
        }
    }
    return true;
}

std::vector<TileSpan> plan_tiles(std::span<LatticeIndex> points, std::uint64_t tile_points,
                                 const std::function<void()>& poll) {
    return points.empty() ? std::vector<TileSpan>{} : cut(points, 0, tile_points, poll);
}

std::vector<TileSpan> plan_tiles(std::span<CarryingPoint> points, std::uint64_t tile_points,
                                 const std::function<void()>& poll) {
    return points.empty() ? std::vector<TileSpan>{} : cut(points, 0, tile_points, poll);
}

}  // namespace knap
