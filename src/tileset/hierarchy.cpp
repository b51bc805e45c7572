#include "tileset/hierarchy.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace knap {

namespace {

constexpr int kHalvings = 3;  // a level

/// Consecutive points, and the tiles that they are in.
struct Part {
    std::uint64_t first = 0;
    std::uint64_t points = 0;
    std::size_t first_tile = 0;
    std::size_t tiles = 0;
};

class Planner {
  public:
    explicit Planner(std::span<const std::uint64_t> tile_points) {
        firsts_.reserve(tile_points.size() + 1);
        firsts_.push_back(0);
        for (const std::uint64_t points : tile_points) {
            firsts_.push_back(firsts_.back() + points);
        }
    }

    std::vector<TreeNode> plan() {
        if (firsts_.back() > 0) {
            add({0, firsts_.back(), 0, firsts_.size() - 1}, TreeNode::kNone);
        }
        return std::move(tree_);
    }

  private:
    void add(const Part& part, std::size_t parent) {
        const std::size_t node = tree_.size();
        tree_.push_back({parent, part.first, part.points, part.first_tile, part.tiles, 1, {}});
        if (part.points <= kTilesetPoints) {
            return;
        }
        // At most half, so that no child is left without points.
        tree_[node].shown =
            std::min(0.5, static_cast<double>(kTilesetPoints) / static_cast<double>(part.points));
        std::vector<Part> parts{part};
        for (int i = 0; i < kHalvings; ++i) {
            std::vector<Part> halves;
            halves.reserve(2 * parts.size());
            for (const Part& whole : parts) {
                if (whole.points <= kTilesetPoints) {
                    halves.push_back(whole);
                } else {
                    const auto [lower, upper] = halve(whole);
                    halves.push_back(lower);
                    halves.push_back(upper);
                }
            }
            parts = std::move(halves);
        }
        for (const Part& child : parts) {
            tree_[node].children.push_back(tree_.size());
            add(child, node);
        }
    }

    // An archive was halved by points too, so that a half ends where a tile does; in an archive
    // that was not, where the nearest does.
    std::pair<Part, Part> halve(const Part& whole) const {
        const std::uint64_t end = whole.first + whole.points;
        std::uint64_t middle = whole.first + whole.points / 2;
        std::size_t lower_tiles = 1;
        if (whole.tiles > 1) {
            const auto begin = firsts_.begin() + static_cast<std::ptrdiff_t>(whole.first_tile);
            const auto last = begin + static_cast<std::ptrdiff_t>(whole.tiles);
            auto cut = std::lower_bound(begin + 1, last - 1, middle);
            if (cut - begin > 1 && *cut - middle > middle - *(cut - 1)) {
                --cut;
            }
            middle = *cut;
            lower_tiles = static_cast<std::size_t>(cut - begin);
        }
        const std::size_t upper_tile = whole.first_tile + (whole.tiles > 1 ? lower_tiles : 0);
        return {{whole.first, middle - whole.first, whole.first_tile, lower_tiles},
                {middle, end - middle, upper_tile, whole.first_tile + whole.tiles - upper_tile}};
    }

    std::vector<std::uint64_t> firsts_;  // of each tile; then the number of points
    std::vector<TreeNode> tree_;
};

}  // namespace

std::vector<TreeNode> plan_tree(std::span<const std::uint64_t> tile_points) {
    return Planner(tile_points).plan();
}

double rank_of(std::uint64_t point) {
    std::uint64_t bits = 0;
    for (int i = 0; i < 64 && point != 0; ++i, point >>= 1) {
        bits |= (point & 1) << (63 - i);
    }
    // Cut, not rounded: never 1.
    return std::ldexp(static_cast<double>(bits >> 11), -53);
}

std::size_t holder_of(std::span<const TreeNode> tree, std::size_t leaf, std::uint64_t point) {
    const double rank = rank_of(point);
    std::size_t node = leaf;
    while (tree[node].parent != TreeNode::kNone && rank < tree[tree[node].parent].shown) {
        node = tree[node].parent;
    }
    return node;
}

}  // namespace knap
