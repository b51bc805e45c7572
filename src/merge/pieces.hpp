#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "knap/geometry.hpp"
#include "merge/range_law.hpp"
#include "store/ranked_run.hpp"

namespace knap {

/// A point with the radius beyond which it stands for nothing if it is kept.
struct RangedPoint {
    Vec3 position;
    double reach = 0;  ///< > 0, cloud units; may be infinite
};

/// Points cut into pieces of near ones, each in the order that they had.
struct Pieces {
    std::vector<RangedPoint> points;    ///< piece by piece
    std::vector<std::uint32_t> places;  ///< of each, where it was before
    std::vector<std::size_t> begins;    ///< piece i is [begins[i], begins[i + 1])
    std::vector<Box> boxes;             ///< of the points of each piece

    std::size_t count() const { return boxes.size(); }
    std::span<const RangedPoint> points_of(std::size_t piece) const {
        return std::span(points).subspan(begins[piece], begins[piece + 1] - begins[piece]);
    }
    std::span<const std::uint32_t> places_of(std::size_t piece) const {
        return std::span(places).subspan(begins[piece], begins[piece + 1] - begins[piece]);
    }
};

/// Cuts points by halving a sample of them across the longest axis, as often as pieces of about
/// `piece_points` take. Pieces may be uneven, or empty; where points coincide, too large.
/// @param points  fewer than 2^32
Pieces cut_into_pieces(std::span<const RankedPoint> points, const RangeLaw& range,
                       std::size_t piece_points);

}  // namespace knap
