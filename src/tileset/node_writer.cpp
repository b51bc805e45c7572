#include "tileset/node_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "base/checksum.hpp"
#include "base/file.hpp"
#include "emit/attribute_plan.hpp"
#include "emit/tile_layout.hpp"
#include "tileset/pnts.hpp"

namespace knap {

namespace {

constexpr std::size_t kMostParts = 16;

int bits_of(std::span<const LatticeIndex> points, const LatticeIndex& origin) {
    std::uint64_t largest = 1;
    for (const LatticeIndex& point : points) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            largest = std::max(largest, static_cast<std::uint64_t>(point[axis] - origin[axis]));
        }
    }
    return static_cast<int>(std::bit_width(largest));
}

/// The order along a curve through the points: as fine as 20 bits are.
std::vector<std::size_t> curve(std::span<const LatticeIndex> points) {
    const LatticeBounds bounds = bounds_of(points);
    int coarser = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto side = static_cast<std::uint64_t>(bounds.max[axis] - bounds.min[axis]);
        coarser = std::max(coarser, static_cast<int>(std::bit_width(side)) - kTileBits);
    }
    std::vector<LatticeIndex> cells;
    cells.reserve(points.size());
    for (const LatticeIndex& point : points) {
        cells.push_back({(point[0] - bounds.min[0]) >> coarser,
                         (point[1] - bounds.min[1]) >> coarser,
                         (point[2] - bounds.min[2]) >> coarser});
    }
    return coding_order(cells, {}, TileCoding::kCurve);
}

/// Mean distance from each point to the next along the curve: about the spacing of the points.
/// Metres, or cloud units.
double spacing_of(const GatheredPoints& points, const Placement& placement) {
    const Vec3 unit{placement.lattice.step * placement.frame.scale.x,
                    placement.lattice.step * placement.frame.scale.y,
                    placement.lattice.step * placement.frame.scale.z};
    const std::vector<std::size_t> order = curve(points.points);
    double sum = 0;
    for (std::size_t i = 1; i < order.size(); ++i) {
        const LatticeIndex& a = points.points[order[i - 1]];
        const LatticeIndex& b = points.points[order[i]];
        const Vec3 step{static_cast<double>(b[0] - a[0]) * unit.x,
                        static_cast<double>(b[1] - a[1]) * unit.y,
                        static_cast<double>(b[2] - a[2]) * unit.z};
        sum += std::sqrt(squared_distance(step, {}));
    }
    return order.size() > 1 ? sum / static_cast<double>(order.size() - 1) : 0;
}

/// Points of a node by their places in it, and where they lie.
struct Cut {
    std::vector<std::size_t> points;
    Placement placement;
};

/// Halves points across the longest side until each part has whole steps; none if that takes too
/// many parts.
std::optional<std::vector<Cut>> cut(const GatheredPoints& points, const Lattice& lattice,
                                    const Geocentric* earth) {
    std::vector<std::vector<std::size_t>> open(1);
    open.front().resize(points.points.size());
    std::iota(open.front().begin(), open.front().end(), std::size_t{0});
    std::vector<Cut> done;
    while (!open.empty()) {
        if (open.size() + done.size() > kMostParts) {
            return std::nullopt;
        }
        const std::vector<std::size_t> part = std::move(open.back());
        open.pop_back();
        std::vector<LatticeIndex> places;
        places.reserve(part.size());
        std::transform(part.begin(), part.end(), std::back_inserter(places),
                       [&](std::size_t i) { return points.points[i]; });
        const LatticeBounds bounds = bounds_of(places);
        const Placement placement = place_tile(bounds, lattice, earth);
        if (placement.whole_steps) {
            done.push_back({part, placement});
            continue;
        }
        const std::size_t axis = longest_axis(bounds);
        const std::int64_t middle = bounds.min[axis] + (bounds.max[axis] - bounds.min[axis]) / 2;
        if (middle == bounds.max[axis]) {
            return std::nullopt;
        }
        std::vector<std::size_t> lower;
        std::vector<std::size_t> upper;
        std::partition_copy(part.begin(), part.end(), std::back_inserter(lower),
                            std::back_inserter(upper),
                            [&](std::size_t i) { return points.points[i][axis] <= middle; });
        open.push_back(std::move(upper));
        open.push_back(std::move(lower));
    }
    return done;
}

GatheredPoints chosen(const GatheredPoints& points, std::span<const std::size_t> which) {
    const std::size_t row = points.rows.size() / points.points.size();
    GatheredPoints result;
    result.points.reserve(which.size());
    result.numbers.reserve(which.size());
    result.rows.reserve(which.size() * row);
    for (const std::size_t i : which) {
        const auto value = std::span(points.rows).subspan(i * row, row);
        result.points.push_back(points.points[i]);
        result.numbers.push_back(points.numbers[i]);
        result.rows.insert(result.rows.end(), value.begin(), value.end());
    }
    return result;
}

TilesetContent write_file(const std::string& name, const GatheredPoints& points,
                          const Placement& placement, const NodeFormat& format,
                          const Geocentric* earth) {
    const GatheredPoints ordered = chosen(points, curve(points.points));
    std::vector<std::array<float, 3>> positions;
    positions.reserve(ordered.points.size());
    for (const LatticeIndex& point : ordered.points) {
        positions.push_back(coordinates_of(placement, point, earth));
    }
    std::optional<PositionSteps> steps;
    if (placement.whole_steps) {
        steps = PositionSteps{bits_of(ordered.points, placement.origin),
                              placement.lattice.step * placement.unit.x};
    }
    const std::vector<std::byte> bytes =
        encode_pnts({positions, steps, ordered.rows}, format.manifest.attributes, format.plan,
                    format.narrow_colors);
    AtomicFile file(format.folder / name);
    file.write(bytes);
    file.commit();
    return {name, positions.size(), bytes.size(), fmt::format("{:016x}", xxh3_64(bytes))};
}

}  // namespace

WrittenNode write_node(std::size_t number, const GatheredPoints& points,
                       const LatticeBounds& region, const NodeFormat& format,
                       const Geocentric* earth) {
    const GatheredPoints ordered = points.in_order();
    WrittenNode node;
    node.placement = place_tile(region, format.manifest.lattice, earth);
    node.spacing = spacing_of(ordered, node.placement);
    if (!node.placement.whole_steps) {
        if (const auto cuts = cut(ordered, format.manifest.lattice, earth)) {
            for (const Cut& one : *cuts) {
                const std::string name = fmt::format("{:06}-{}.pnts", number, node.parts.size());
                TilesetContent content =
                    write_file(name, chosen(ordered, one.points), one.placement, format, earth);
                node.parts.push_back({one.placement, std::move(content)});
            }
            return node;
        }
    }
    node.parts.push_back({node.placement, write_file(fmt::format("{:06}.pnts", number), ordered,
                                                     node.placement, format, earth)});
    return node;
}

}  // namespace knap
