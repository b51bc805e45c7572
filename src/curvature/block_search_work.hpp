#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "curvature/neighbourhoods.hpp"
#include "curvature/point_blocks.hpp"

namespace knap {

/// Points near the block in work, and distances from the point in work.
struct BlockSearchWork {
    BlockSearchWork(const PointBlocks& searched, std::span<const std::uint8_t> asked,
                    std::size_t neighbours)
        : points(searched),
          centres(asked),
          k(neighbours),
          wanted(std::min(neighbours + 1, searched.size())) {}

    const PointBlocks& points;
    std::span<const std::uint8_t> centres;
    std::size_t k;
    std::size_t wanted;  // points of a neighbourhood, with its centre

    std::size_t candidates = 0;
    std::vector<double> x;
    std::vector<double> y;
    std::vector<double> z;
    std::vector<std::uint64_t> places;
    std::vector<double> near;          // squared distances under a threshold
    std::vector<std::uint64_t> which;  // and which candidates they are of
    double reach = 0;  // squared; within it neighbourhoods of the block before were found
    Neighbourhoods found;

    /// Room for so many candidates, and to write a vector past them.
    void reserve(std::size_t count) {
        constexpr std::size_t kPadding = PointBlocks::kPadding;
        if (x.size() < count + kPadding) {
            const std::size_t size = 2 * count + kPadding;
            for (std::vector<double>* values : {&x, &y, &z, &near}) {
                values->resize(size);
            }
            places.resize(size);
            which.resize(size);
        }
    }
};

/// A squared distance within which every point of the box has as many points as wanted: the
/// nearest blocks that hold so many, measured to their far corners.
double sufficient_reach(const BlockSearchWork& work, const Box& box);

/// Puts the wanted ones of the `near` points that were kept to the front, where equal distances
/// straddle the last place: the lowest ids win, and the centre comes before all.
void settle_ties(BlockSearchWork& work, std::size_t centre, std::size_t near);

}  // namespace knap
