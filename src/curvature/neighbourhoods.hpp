#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace knap {

/// Most points of a neighbourhood.
constexpr std::size_t kMostNeighbourhood = 256;

/// Neighbourhoods of some points, each a set without order: coordinates relative to the point,
/// axis by axis. The point itself is among them, at (0, 0, 0).
///
/// Neighbourhood i has the values [i * stride, i * stride + size) of x, y and z. What computes on
/// a neighbourhood must not depend on the order of its points: the order is that of the search.
struct Neighbourhoods {
    /// Values a stride is a multiple of, and that may be read past the last neighbourhood.
    static constexpr std::size_t kPadding = 8;

    std::size_t count = 0;   ///< of neighbourhoods
    std::size_t size = 0;    ///< points of each, with the point itself
    std::size_t stride = 0;  ///< >= size
    std::vector<double> x;   ///< offsets, cloud units; anything behind `size`
    std::vector<double> y;
    std::vector<double> z;
    std::vector<std::uint32_t> centres;   ///< place of the point of each neighbourhood
    std::vector<double> squared_reaches;  ///< largest squared distance in each; infinite if there
                                          ///< were fewer points than wanted

    /// Makes room for neighbourhoods of a size; contents are undefined.
    void resize(std::size_t new_count, std::size_t new_size);
};

}  // namespace knap
