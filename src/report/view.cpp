#include "report/view.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/vector.hpp"

namespace knap {

namespace {

// Of the points, those that a frame may leave out on each side if they lie far from the others.
constexpr double kOutliers = 0.0005;
// How far beyond the others they are still shown, in spans of the others.
constexpr double kReach = 0.15;
constexpr double kMargin = 0.04;
constexpr double kFlat = 0.35;
constexpr int kSmallestSide = 480;

Vec3 scaled(const Vec3& v, double factor) {
    return {v.x * factor, v.y * factor, v.z * factor};
}

Vec3 unit_axis(int axis) {
    Vec3 v;
    v[axis] = 1;
    return v;
}

/// The view of an eye that stands `azimuth` degrees round `up` from `front`, `elevation` degrees
/// high.
View view_from(std::string name, const Vec3& front, const Vec3& up, double azimuth,
               double elevation) {
    constexpr double kDegree = std::numbers::pi / 180;
    const Vec3 side = cross(up, front);
    const Vec3 level =
        scaled(front, std::cos(azimuth * kDegree)) + scaled(side, std::sin(azimuth * kDegree));
    View view;
    view.name = std::move(name);
    view.toward =
        scaled(level, std::cos(elevation * kDegree)) + scaled(up, std::sin(elevation * kDegree));
    view.right = cross(up, level);
    view.up = cross(view.toward, view.right);
    return view;
}

Vec3 middle_of(const Box& box) {
    return box.empty() ? Vec3{} : scaled(box.min + box.max, 0.5);
}

}  // namespace

std::array<View, 2> choose_views(const Box& box, bool is_terrain) {
    const Vec3 size = box.size();
    const bool lies_on_y = size.y <= size.x && size.y < size.z;
    const int lowest = lies_on_y ? 1 : 2;
    const double others = std::min(size.x, size[lowest == 1 ? 2 : 1]);
    if (is_terrain || size[lowest] < kFlat * others) {
        // The longer side of the ground lies across the picture.
        const Vec3 up = unit_axis(lowest);
        const int depth_axis = size.x >= size[3 - lowest] ? 3 - lowest : 0;
        // Right is then along the growing coordinate, where the box is longer.
        const Vec3 front =
            depth_axis == 0 ? cross(unit_axis(3 - lowest), up) : cross(unit_axis(0), up);
        return {view_from("obliquely from above", front, up, 25, 50),
                is_terrain ? view_from("from above, from the opposite side", front, up, 205, 50)
                           : view_from("obliquely from below", front, up, 25, -50)};
    }
    // What stands has its height along y, as scans of objects mostly have, or along z if that is
    // the longest side.
    const int upright = size.z > size.x && size.z > size.y ? 2 : 1;
    const Vec3 up = unit_axis(upright);
    const int other = 3 - upright;
    const Vec3 front =
        size.x >= size[other] ? cross(unit_axis(0), up) : cross(unit_axis(other), up);
    return {view_from("from the front, a little above", front, up, 25, 18),
            view_from("from the opposite side", front, up, 205, 18)};
}

Place Frame::place_of(const Vec3& p) const {
    const Vec3 from = p - centre;
    return {(dot(from, view.right) - left) / pixel, (top - dot(from, view.up)) / pixel,
            (near - dot(from, view.toward)) / pixel};
}

FrameFinder::FrameFinder(View view, const Box& box)
    : view_(std::move(view)),
      centre_(middle_of(box)),
      radius_(box.diagonal() > 0 ? box.diagonal() / 2 : 1),
      across_(kBins),
      upward_(kBins) {}

std::size_t FrameFinder::bin_of(double along) const {
    const double place = (along / radius_ + 1) / 2 * static_cast<double>(kBins);
    return static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(kBins - 1)));
}

void FrameFinder::add(const Vec3& p) {
    const Vec3 from = p - centre_;
    ++across_[bin_of(dot(from, view_.right))];
    ++upward_[bin_of(dot(from, view_.up))];
    ++points_;
}

void FrameFinder::add(const FrameFinder& other) {
    for (std::size_t i = 0; i < kBins; ++i) {
        across_[i] += other.across_[i];
        upward_[i] += other.upward_[i];
    }
    points_ += other.points_;
}

std::array<double, 2> FrameFinder::span_of(const std::vector<std::uint64_t>& bins) const {
    const auto most = static_cast<std::uint64_t>(kOutliers * static_cast<double>(points_));
    // The bin that has the point of a rank, counted from one end.
    const auto bin_at = [&](auto begin, auto end, std::uint64_t rank) {
        std::uint64_t before = 0;
        const auto at =
            std::find_if(begin, end, [&](std::uint64_t count) { return (before += count) > rank; });
        return static_cast<double>(at - begin);
    };
    const auto bins_count = static_cast<double>(kBins);
    const double first = bin_at(bins.begin(), bins.end(), 0);
    const double last = bins_count - bin_at(bins.rbegin(), bins.rend(), 0);
    const double low = bin_at(bins.begin(), bins.end(), most);
    const double high = bins_count - bin_at(bins.rbegin(), bins.rend(), most);
    const double reach = kReach * (high - low);
    const auto coordinate = [&](double bin) { return (2 * bin / bins_count - 1) * radius_; };
    return {coordinate(std::max(first, low - reach)), coordinate(std::min(last, high + reach))};
}

Frame FrameFinder::frame(int width, int height) const {
    std::array<double, 2> across{-radius_, radius_};
    std::array<double, 2> upward{-radius_, radius_};
    if (points_ > 0) {
        across = span_of(across_);
        upward = span_of(upward_);
    }
    const double wide = (across[1] - across[0]) * (1 + 2 * kMargin);
    const double high = (upward[1] - upward[0]) * (1 + 2 * kMargin);
    Frame frame;
    frame.view = view_;
    frame.centre = centre_;
    frame.pixel = std::max(wide / width, high / height);
    // Even, because pictures are halved.
    const auto pixels = [&](double length, int most) {
        const int exact = static_cast<int>(std::ceil(length / frame.pixel));
        return std::clamp((exact + 1) / 2 * 2, std::min(kSmallestSide, most), most);
    };
    frame.width = pixels(wide, width);
    frame.height = pixels(high, height);
    frame.left = (across[0] + across[1]) / 2 - frame.width * frame.pixel / 2;
    frame.top = (upward[0] + upward[1]) / 2 + frame.height * frame.pixel / 2;
    frame.near = radius_;
    frame.depth = 2 * radius_;
    return frame;
}

}  // namespace knap
