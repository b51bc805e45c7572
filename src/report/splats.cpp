#include "report/splats.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace knap {

namespace {

//     63    depth    36 35   code   24 23  facing  0
constexpr int kDepthBits = 28;
constexpr int kCodeShift = 24;
constexpr int kDepthShift = 36;
constexpr std::uint64_t kCodeMask = 0xfff;
constexpr std::uint32_t kFacingMask = 0xffffff;
constexpr double kDeepest = (1 << kDepthBits) - 2;  // one less than the depth of an empty pixel

// How much farther a disc is drawn at its rim than it is, in radii: of overlapping discs the one
// with the nearest centre is seen.
constexpr double kBowl = 0.2;

std::uint32_t pack_unit(double value) {
    return static_cast<std::uint32_t>(std::lround((std::clamp(value, -1.0, 1.0) + 1) / 2 * 4095));
}

}  // namespace

PixelSpan pixels_within(double middle, double radius, int size) {
    const double first = std::clamp(std::ceil(middle - radius - 0.5), 0.0, double(size));
    const double last = std::clamp(std::floor(middle + radius - 0.5), -1.0, size - 1.0);
    return {static_cast<int>(first), static_cast<int>(last)};
}

std::uint32_t pack_facing(const Facing& facing) {
    return pack_unit(facing.x) << 12 | pack_unit(facing.y);
}

Facing unpack_facing(std::uint32_t packed) {
    const auto unit = [](std::uint32_t bits) { return static_cast<float>(bits) / 4095.0F * 2 - 1; };
    const float x = unit(packed >> 12 & 0xfff);
    const float y = unit(packed & 0xfff);
    return {x, y, std::sqrt(std::max(0.0F, 1 - x * x - y * y))};
}

SplatBuffer::SplatBuffer(const Frame& frame)
    : SplatBuffer(frame, std::vector<std::uint64_t>(
                             static_cast<std::size_t>(frame.width) * frame.height, kEmpty)) {}

SplatBuffer::SplatBuffer(const Frame& frame, std::vector<std::uint64_t> pixels)
    : width_(frame.width),
      height_(frame.height),
      // Rims and bowls reach behind what is farthest.
      steps_(kDeepest / (1.25 * frame.depth / frame.pixel)),
      pixels_(std::move(pixels)) {}

void SplatBuffer::offer(int x, int y, const Splat& splat) {
    const double depth = std::clamp(splat.depth * steps_, 0.0, kDeepest);
    const std::uint64_t mine = static_cast<std::uint64_t>(depth) << kDepthShift |
                               std::uint64_t{splat.code} << kCodeShift | splat.facing;
    const std::atomic_ref<std::uint64_t> pixel(pixels_[index(x, y)]);
    std::uint64_t there = pixel.load(std::memory_order_relaxed);
    while (mine < there && !pixel.compare_exchange_weak(there, mine, std::memory_order_relaxed)) {
    }
}

void SplatBuffer::draw(const Place& place, double radius, std::uint32_t code) {
    const std::uint32_t facing = pack_facing({});
    if (radius < 1) {
        const double x = std::floor(place.x);
        const double y = std::floor(place.y);
        if (x >= 0 && x < width_ && y >= 0 && y < height_) {
            offer(static_cast<int>(x), static_cast<int>(y), {place.depth, code, facing});
        }
        return;
    }
    const PixelSpan rows = pixels_within(place.y, radius, height_);
    const PixelSpan columns = pixels_within(place.x, radius, width_);
    for (int y = rows.first; y <= rows.last; ++y) {
        const double dy = y + 0.5 - place.y;
        for (int x = columns.first; x <= columns.last; ++x) {
            const double dx = x + 0.5 - place.x;
            const double square = dx * dx + dy * dy;
            if (square <= radius * radius) {
                offer(x, y, {place.depth + kBowl * square / radius, code, facing});
            }
        }
    }
}

Splat SplatBuffer::at(int x, int y) const {
    const std::uint64_t pixel = pixels_[index(x, y)];
    return {static_cast<double>(pixel >> kDepthShift) / steps_,
            static_cast<std::uint32_t>(pixel >> kCodeShift & kCodeMask),
            static_cast<std::uint32_t>(pixel) & kFacingMask};
}

}  // namespace knap
