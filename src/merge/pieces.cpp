#include "merge/pieces.hpp"

#include <algorithm>
#include <array>

#include "base/threads.hpp"

namespace knap {

namespace {

// Points of the sample for each piece: enough for pieces that differ by a tenth or so.
constexpr std::size_t kSampled = 128;
// Points that a thread takes at a time.
constexpr std::size_t kStretch = std::size_t{1} << 16;

/// Faces of a balanced tree: node i has the children 2 i + 1 and 2 i + 2.
class CutTree {
  public:
    CutTree(std::span<const RankedPoint> points, std::size_t depth)
        : faces_((std::size_t{1} << depth) - 1), depth_(depth) {
        std::vector<Vec3> sample(std::min(points.size(), kSampled << depth));
        for (std::size_t i = 0; i < sample.size(); ++i) {
            sample[i] = points[i * points.size() / sample.size()].position;
        }
        cut(0, sample);
    }

    std::size_t pieces() const { return faces_.size() + 1; }

    std::size_t piece_of(const Vec3& p) const {
        const std::array<double, 3> coordinates{p.x, p.y, p.z};
        std::size_t at = 0;
        for (std::size_t level = 0; level < depth_; ++level) {
            const Face& face = faces_[at];
            at = 2 * at + 2 - static_cast<std::size_t>(coordinates[face.axis] < face.at);
        }
        return at - faces_.size();
    }

  private:
    struct Face {
        std::size_t axis = 0;
        double at = 0;
    };

    void cut(std::size_t node, std::span<Vec3> sample) {
        if (node >= faces_.size() || sample.empty()) {
            return;
        }
        Box box;
        for (const Vec3& p : sample) {
            box.extend(p);
        }
        const int axis = box.longest_axis();
        const auto half = static_cast<std::ptrdiff_t>(sample.size() / 2);
        std::nth_element(sample.begin(), sample.begin() + half, sample.end(),
                         [axis](const Vec3& a, const Vec3& b) { return a[axis] < b[axis]; });
        faces_[node] = {static_cast<std::size_t>(axis), sample[sample.size() / 2][axis]};
        cut(2 * node + 1, sample.first(sample.size() / 2));
        cut(2 * node + 2, sample.subspan(sample.size() / 2));
    }

    std::vector<Face> faces_;
    std::size_t depth_;
};

/// What one stretch of the points has of one piece.
struct Share {
    std::size_t count = 0;
    std::size_t begin = 0;  ///< where its points go
    Box box;
};

}  // namespace

Pieces cut_into_pieces(std::span<const RankedPoint> points, const RangeLaw& range,
                       std::size_t piece_points) {
    std::size_t depth = 0;
    while (piece_points << depth < points.size()) {
        ++depth;
    }
    const CutTree tree(points, depth);
    const std::size_t stretches = (points.size() + kStretch - 1) / kStretch;
    std::vector<std::uint32_t> piece_of(points.size());
    std::vector<Share> shares(stretches * tree.pieces());
    const auto each = [&](const auto& body) {
        parallel_for(stretches, 1, [&](std::size_t first, std::size_t last) {
            for (std::size_t stretch = first; stretch < last; ++stretch) {
                const std::span own = std::span(shares).subspan(stretch * tree.pieces());
                const std::size_t end = std::min((stretch + 1) * kStretch, points.size());
                for (std::size_t i = stretch * kStretch; i < end; ++i) {
                    body(i, own);
                }
            }
        });
    };
    each([&](std::size_t i, std::span<Share> own) {
        const std::size_t piece = tree.piece_of(points[i].position);
        piece_of[i] = static_cast<std::uint32_t>(piece);
        ++own[piece].count;
        own[piece].box.extend(points[i].position);
    });

    Pieces result;
    result.boxes.resize(tree.pieces());
    std::size_t begin = 0;
    for (std::size_t piece = 0; piece < tree.pieces(); ++piece) {
        result.begins.push_back(begin);
        for (std::size_t stretch = 0; stretch < stretches; ++stretch) {
            Share& share = shares[stretch * tree.pieces() + piece];
            share.begin = begin;
            begin += share.count;
            result.boxes[piece].extend(share.box);
        }
    }
    result.begins.push_back(begin);

    result.points.resize(points.size());
    result.places.resize(points.size());
    each([&](std::size_t i, std::span<Share> own) {
        const std::size_t to = own[piece_of[i]].begin++;
        result.points[to] = {points[i].position, range.reach(points[i].key)};
        result.places[to] = static_cast<std::uint32_t>(i);
    });
    return result;
}

}  // namespace knap
