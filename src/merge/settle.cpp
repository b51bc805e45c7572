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
        return box.squared_distance_to(p.position) <= p.reach * p.reach;
    });
}

/// All points of a part and what they stand for.
struct Part {
    std::span<const RankedPoint> points;
    const RangeLaw& range;
};

/// Walks points in the method's order. Of those that nothing marks, the ones that touch what is
/// outside, or are in the region of such a one, stay open.
/// @param box     of the points
/// @param places  of each point in the part
void walk(const Part& part, std::span<const RangedPoint> points,
          std::span<const std::uint32_t> places, const Box& box, std::span<const Box> outside,
          std::span<Fate> fates) {
    const RegionShape& shape = part.range.shape();
    Coverage kept(box, shape);
    Coverage open(box, shape);
    const auto add = [&](Coverage& to, std::size_t i) {
        if (shape.is_ball()) {
            to.add(points[i].position, points[i].reach);
        } else {
            to.add(points[i].position, part.range.region(part.points[places[i]]));
        }
    };
    for (std::size_t i = 0; i < points.size(); ++i) {
        const RangedPoint& p = points[i];
        if (kept.marks(p.position)) {
            fates[places[i]] = Fate::kRepresented;
        } else if (open.marks(p.position) || touches(p, outside)) {
            add(open, i);
            fates[places[i]] = Fate::kOpen;
        } else {
            add(kept, i);
            fates[places[i]] = Fate::kKept;
        }
    }
}

void walk_piece(const Part& part, const Pieces& pieces, std::size_t piece,
                std::span<const Box> outside, std::span<Fate> fates) {
    const std::span<const RangedPoint> points = pieces.points_of(piece);
    if (points.empty()) {
        return;
    }
    // The last one reaches farthest.
    const Box& box = pieces.boxes[piece];
    const double reach = points.back().reach;
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
    walk(part, points, pieces.places_of(piece), box, near, fates);
}

void walk_open(const Part& part, std::span<const Box> outside, std::span<Fate> fates) {
    const std::span<const RankedPoint> points = part.points;
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
            open.push_back({points[i].position, part.range.reach(points[i].key)});
            places.push_back(static_cast<std::uint32_t>(i));
            box.extend(points[i].position);
        }
    }
    walk(part, open, places, box, outside, fates);
}

}  // namespace

std::vector<Fate> settle(std::span<const RankedPoint> points, const RangeLaw& range,
                         std::span<const Box> outside) {
    std::vector<Fate> fates(points.size());
    if (points.empty()) {
        return fates;
    }
    const Part part{points, range};
    bool is_cut = false;
    {
        const Pieces pieces = cut_into_pieces(points, range, kPiecePoints);
        is_cut = pieces.count() > 1;
        parallel_for(pieces.count(), 1, [&](std::size_t first, std::size_t last) {
            for (std::size_t piece = first; piece < last; ++piece) {
                walk_piece(part, pieces, piece, outside, fates);
            }
        });
    }
    if (is_cut) {
        walk_open(part, outside, fates);
    }
    return fates;
}

std::uint64_t settle_bytes_per_point() {
    // A point of a piece, its place, its piece and its fate.
    return sizeof(RangedPoint) + 2 * sizeof(std::uint32_t) + sizeof(Fate);
}

}  // namespace knap
