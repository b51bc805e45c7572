#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "report/view.hpp"

namespace knap {

/// A direction that a surface faces, seen from the eye: right, down, toward; a unit vector.
struct Facing {
    float x = 0;
    float y = 0;
    float z = 1;
};

/// A direction in 24 bits, good to a fortieth of a degree.
std::uint32_t pack_facing(const Facing& facing);
Facing unpack_facing(std::uint32_t packed);

/// Whole numbers from first to last; none if last < first.
struct PixelSpan {
    int first = 0;
    int last = 0;
};

/// The pixels of [0, size) whose centres are within `radius` of `middle`.
PixelSpan pixels_within(double middle, double radius, int size);

/// What a pixel shows.
struct Splat {
    double depth = 0;          ///< pixels behind the nearest possible place
    std::uint32_t code = 0;    ///< of the curvature: see CurvatureScale
    std::uint32_t facing = 0;  ///< packed
};

/// Splats with a depth buffer. A pixel is one number, and the least wins: the nearest splat, of
/// equally near ones that of the lowest code. So the picture does not depend on the order of
/// points, and any number of threads may draw at once.
class SplatBuffer {
  public:
    static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};

    explicit SplatBuffer(const Frame& frame);
    /// @param pixels  as pixels() gave them
    SplatBuffer(const Frame& frame, std::vector<std::uint64_t> pixels);

    /// A disc that faces the eye.
    /// @param radius  pixels; below one it is one pixel
    void draw(const Place& place, double radius, std::uint32_t code);

    bool is_empty(int x, int y) const { return pixels_[index(x, y)] == kEmpty; }
    /// @note not of an empty pixel
    Splat at(int x, int y) const;

    /// Shows a splat in a pixel, if nothing nearer is there.
    /// @param x, y  in the picture
    void offer(int x, int y, const Splat& splat);

    int width() const { return width_; }
    int height() const { return height_; }
    std::span<const std::uint64_t> pixels() const { return pixels_; }

  private:
    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
               static_cast<std::size_t>(x);
    }

    int width_;
    int height_;
    double steps_;  // of the stored depth, a pixel
    std::vector<std::uint64_t> pixels_;
};

}  // namespace knap
