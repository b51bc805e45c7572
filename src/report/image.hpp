#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace knap {

/// Red, green, blue, each 0 to 255.
using Colour = std::array<std::uint8_t, 3>;

/// A picture, row by row from the top.
struct Image {
    int width = 0;
    int height = 0;
    std::vector<Colour> pixels;

    Image() = default;
    Image(int columns, int rows, const Colour& fill = {})
        : width(columns),
          height(rows),
          pixels(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), fill) {}

    Colour& at(int x, int y) { return pixels[index(x, y)]; }
    const Colour& at(int x, int y) const { return pixels[index(x, y)]; }

  private:
    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(x);
    }
};

/// A picture as a PNG file.
/// @param image  at least one pixel
/// @throws StorageError if libpng cannot
std::vector<std::byte> encode_png(const Image& image);

}  // namespace knap
