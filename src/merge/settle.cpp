#include "merge/settle.hpp"

#include <algorithm>
#include <iterator>

#include "base/threads.hpp"
#include "merge/coverage.hpp"
#include "merge/pieces.hpp"

namespace knap {

namespace {

// About what a cache of the second level holds of kept points.
constexpr std::size_t kPiecePoints = std::size_t{1} << 16;
// Where pieces leave more than this share open, a walk of the whole decides little more.
constexpr double kWorthAnotherWalk = 0.5;

// squared_distance_to() is monotone like squared_distance(), so no point of a box is nearer.
bool touches(const RangedPoint& p, std::span<const Box> outside) {
    return std::any_of(outside.begin(), outside.end(), [&](const Box& box) {
        return box.squared_distance_to(p.position) <= p.range * p.range;
    });
}

/// Walks points in the method's order. Of those that nothing marks, the ones that touch what is
/// outside, or are within reach of such a one, stay open.
/// @param box     of the points
/// @param places  of each point in `fates`
void walk(std::span<const RangedPoint> points, std::span<const std::uint32_t> places,
          const Box& box, std::span<const Box> outside, std::span<Fate> fates) {
    Coverage kept(box);
    Coverage open(box);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const RangedPoint& p = points[i];
        if (kept.marks(p.position)) {
            fates[places[i]] = Fate::kRepresented;
        } else if (open.marks(p.position) || touches(p, outside)) {
            open.add(p.position, p.range);
            fates[places[i]] = Fate::kOpen;
        } else {
            kept.add(p.position, p.range);
            fates[places[i]] = Fate::kKept;
        }
    }
}

void walk_piece(const Pieces& pieces, std::size_t piece, std::span<const Box> outside,
                std::span<Fate> fates) {
    const std::span<const RangedPoint> points = pieces.points_of(piece);
    if (points.empty()) {
        return;
    }
    // The last range is the largest.
    const Box& box = pieces.boxes[piece];
    const double reach = points.back().range;
    const auto is_near = [&](const Box& other) {
        return box.squared_distance_to(other) <= reach * reach;
    };
    std::vector<Box> near;
    std::copy_if(outside.begin(), outside.end(), std::back_inserter(near), is_near);
    for (std::size_t other = 0; other < pieces.count(); ++other) {
        if (other != piece && is_near(pieces.boxes[other])) {
            near.push_back(pieces.boxes[other]);
        }
    }
    walk(points, pieces.places_of(piece), box, near, fates);
}

void walk_open(std::span<const RankedPoint> points, const RangeLaw& range,
               std::span<const Box> outside, std::span<Fate> fates) {
    const auto count =
        static_cast<std::size_t>(std::count(fates.begin(), fates.end(), Fate::kOpen));
    const double share = static_cast<double>(count) / static_cast<double>(points.size());
    if (!outside.empty() && share >= kWorthAnotherWalk) {
        return;
    }
    std::vector<RangedPoint> open;
    std::vector<std::uint32_t> places;
    open.reserve(count);
    places.reserve(count);
    Box box;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (fates[i] == Fate::kOpen) {
            open.push_back({points[i].position, range.of(points[i].key)});
            places.push_back(static_cast<std::uint32_t>(i));
            box.extend(points[i].position);
        }
    }
    walk(open, places, box, outside, fates);
}

}  // namespace

std::vector<Fate> settle(std::span<const RankedPoint> points, const RangeLaw& range,
                         std::span<const Box> outside) {
    std::vector<Fate> fates(points.size());
    if (points.empty()) {
        return fates;
    }
    bool is_cut = false;
    {
        const Pieces pieces = cut_into_pieces(points, range, kPiecePoints);
        is_cut = pieces.count() > 1;
        parallel_for(pieces.count(), 1, [&](std::size_t first, std::size_t last) {
            for (std::size_t piece = first; piece < last; ++piece) {
                walk_piece(pieces, piece, outside, fates);
            }
        });
    }
    if (is_cut) {
        walk_open(points, range, outside, fates);
    }
    return fates;
}

std::uint64_t settle_bytes_per_point() {
    // A point of a piece, its place, its piece and its fate.
    return sizeof(RangedPoint) + 2 * sizeof(std::uint32_t) + sizeof(Fate);
}

}  // namespace knap
