#include "tileset/tile_points.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <numeric>

#include "emit/attribute_plan.hpp"
#include "emit/tile_layout.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

void extend(LatticeBounds& bounds, const LatticeBounds& more) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        bounds.min[axis] = std::min(bounds.min[axis], more.min[axis]);
        bounds.max[axis] = std::max(bounds.max[axis], more.max[axis]);
    }
}

std::vector<CarryingPoint> on_lattice(const Tile& tile, const Lattice& lattice) {
    std::vector<CarryingPoint> points;
    points.reserve(tile.positions.size());
    for (const Vec3& position : tile.positions) {
        const LatticeIndex index = index_of(lattice, position);
        if (position_of(lattice, index) != position) {
            throw InputError("expected positions that the lattice tells apart, found others");
        }
        points.push_back({index, points.size()});
    }
    return points;
}

void append_row(const Tile& tile, std::span<const Attribute> attributes, std::size_t point,
                std::vector<std::byte>& rows) {
    for (std::size_t c = 0; c < attributes.size(); ++c) {
        const auto size = attributes[c].value_size();
        const auto value = std::span(tile.columns[c]).subspan(point * size, size);
        rows.insert(rows.end(), value.begin(), value.end());
    }
}

}  // namespace

void GatheredPoints::append(const GatheredPoints& more) {
    points.insert(points.end(), more.points.begin(), more.points.end());
    numbers.insert(numbers.end(), more.numbers.begin(), more.numbers.end());
    rows.insert(rows.end(), more.rows.begin(), more.rows.end());
}

GatheredPoints GatheredPoints::in_order() const {
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return numbers[a] < numbers[b]; });
    const std::size_t row = points.empty() ? 0 : rows.size() / points.size();
    GatheredPoints sorted;
    sorted.points.reserve(points.size());
    sorted.numbers.reserve(points.size());
    sorted.rows.reserve(rows.size());
    for (const std::size_t i : order) {
        sorted.points.push_back(points[i]);
        sorted.numbers.push_back(numbers[i]);
        const auto value = std::span(rows).subspan(i * row, row);
        sorted.rows.insert(sorted.rows.end(), value.begin(), value.end());
    }
    return sorted;
}

std::vector<NodeShare> share_out(const Tile& tile, const Manifest& manifest, std::uint64_t first,
                                 std::span<const TreeNode> tree,
                                 std::span<const std::size_t> leaves) {
    std::vector<CarryingPoint> points = on_lattice(tile, manifest.lattice);
    std::map<std::size_t, NodeShare> shares;
    for (const TileSpan& span : plan_tiles(points, kTilesetPoints)) {
        const auto begin = points.begin() + static_cast<std::ptrdiff_t>(span.first);
        std::vector<LatticeIndex> places;
        places.reserve(span.count);
        std::transform(begin, begin + static_cast<std::ptrdiff_t>(span.count),
                       std::back_inserter(places),
                       [](const CarryingPoint& point) { return point.index; });
        const auto behind = std::upper_bound(
            leaves.begin(), leaves.end(), first + span.first,
            [&](std::uint64_t point, std::size_t leaf) { return point < tree[leaf].first; });
        const std::size_t leaf = *(behind - 1);
        for (std::size_t node = leaf; node != TreeNode::kNone; node = tree[node].parent) {
            const auto [share, added] = shares.try_emplace(node, NodeShare{node, span.bounds, {}});
            extend(share->second.bounds, span.bounds);
        }
        std::uint64_t number = first + span.first;
        for (const std::size_t i : coding_order(places, span.bounds.min, TileCoding::kCurve)) {
            GatheredPoints& held = shares.at(holder_of(tree, leaf, number)).points;
            held.points.push_back(places[i]);
            held.numbers.push_back(number);
            append_row(tile, manifest.attributes, begin[static_cast<std::ptrdiff_t>(i)].row,
                       held.rows);
            ++number;
        }
    }
    std::vector<NodeShare> result;
    result.reserve(shares.size());
    for (auto& [node, share] : shares) {
        result.push_back(std::move(share));
    }
    return result;
}

}  // namespace knap
