#include "rank/spacing.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <mutex>
#include <span>
#include <unordered_set>
#include <utility>

#include "base/checksum.hpp"
#include "base/threads.hpp"
#include "curvature/block_search.hpp"

namespace knap {

namespace {

constexpr std::uint64_t kAllBelow = 1'000'000;
constexpr double kSampled = 1'250'000;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// How far a search sees: no point is missing from it that is nearer than all of these allow.
struct Limits {
    const Box& halo;
    const Box& archive;
    double within_squared;
};

// Adds to `result` what is certain of the centres, and those whose neighbour may be in another
// brick; returns the ones whose neighbour may be farther than the search saw.
std::vector<Straggler> measure(const PointBlocks& points, std::span<const std::uint8_t> centres,
                               const Limits& limits, BrickSpacing& result) {
    std::vector<Straggler> open;
    std::mutex mutex;
    constexpr std::size_t kGrainBlocks = 256;
    parallel_for(points.blocks.size(), kGrainBlocks, [&](std::size_t first, std::size_t last) {
        BlockSearch search(points, centres, 1);
        BrickSpacing part;
        std::vector<Straggler> part_open;
        for (std::size_t block = first; block < last; ++block) {
            const Neighbourhoods& found = search.around(block);
            for (std::size_t i = 0; i < found.count; ++i) {
                const std::uint32_t place = found.centres[i];
                const Vec3 p = points.position(place);
                const double squared = found.squared_reaches[i];
                const double certain = certain_squared_distance(p, limits.halo, limits.archive);
                if (squared < std::min(certain, limits.within_squared)) {
                    part.sum.add(std::sqrt(squared));
                    ++part.count;
                } else if (squared < limits.within_squared || limits.within_squared == kInfinity) {
                    part.stragglers.push_back({p, points.ids[place], squared});
                } else {
                    part_open.push_back({p, points.ids[place], squared});
                }
            }
        }
        const std::scoped_lock lock(mutex);
        result.sum.add(part.sum);
        result.count += part.count;
        result.stragglers.insert(result.stragglers.end(), part.stragglers.begin(),
                                 part.stragglers.end());
        open.insert(open.end(), part_open.begin(), part_open.end());
    });
    return open;
}

// The same for some points among those of the blocks.
std::vector<TaggedPoint> measure_open(const PointBlocks& points, std::span<const TaggedPoint> open,
                                      const Limits& limits, BrickSpacing& result) {
    std::unordered_set<PointId> ids;
    for (const TaggedPoint& point : open) {
        ids.insert(point.id());
    }
    std::vector<std::uint8_t> centres(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        centres[i] = points.is_core[i] != 0 && ids.contains(points.ids[i]) ? 1 : 0;
    }
    std::vector<TaggedPoint> left;
    for (const Straggler& straggler : measure(points, centres, limits, result)) {
        left.emplace_back(straggler.position, straggler.id, true);
    }
    return left;
}

double power_of_two_above(double value) {
    int exponent = 0;
    std::frexp(value, &exponent);
    return std::ldexp(1.0, exponent);
}

// Larger than the distance from most points to their nearest: read off a few.
double cell_size_for(std::span<const TaggedPoint> centres, std::span<const TaggedPoint> points) {
    constexpr std::size_t kProbes = 4;
    double farthest = 0;
    for (std::size_t i = 0; i < std::min(kProbes, centres.size()); ++i) {
        const Vec3 centre = centres[i * centres.size() / kProbes % centres.size()].position;
        double nearest = kInfinity;
        for (const TaggedPoint& point : points) {
            const double squared = squared_distance(centre, point.position);
            nearest = squared > 0 ? std::min(nearest, squared) : nearest;
        }
        farthest = std::max(farthest, nearest);
    }
    return farthest > 0 ? power_of_two_above(2 * std::sqrt(farthest)) : kInfinity;
}

/// The cells of a grid that centres stand in, and those around them, as a hashed set: some others
/// pass for such cells, which costs time and changes nothing.
class NearCells {
  public:
    /// @param cell  edge, a power of two: then no rounding moves a point to another cell
    NearCells(std::span<const TaggedPoint> centres, double cell) : cell_(cell) {
        constexpr std::size_t kBitsPerCell = 32;
        std::size_t bits = 64;
        while (bits < centres.size() * 27 * kBitsPerCell) {
            bits *= 2;
        }
        words_.resize(bits / 64);
        for (const TaggedPoint& centre : centres) {
            const Cell at = cell_of(centre.position);
            for (const double x : {at.x - 1, at.x, at.x + 1}) {
                for (const double y : {at.y - 1, at.y, at.y + 1}) {
                    for (const double z : {at.z - 1, at.z, at.z + 1}) {
                        const std::size_t bit = bit_of({x, y, z});
                        words_[bit / 64] |= std::uint64_t{1} << (bit % 64);
                    }
                }
            }
        }
    }

    bool contain(const Vec3& p) const {
        const std::size_t bit = bit_of(cell_of(p));
        return (words_[bit / 64] >> (bit % 64) & 1) != 0;
    }

  private:
    struct Cell {
        double x;
        double y;
        double z;
    };

    Cell cell_of(const Vec3& p) const {
        return {std::floor(p.x / cell_), std::floor(p.y / cell_), std::floor(p.z / cell_)};
    }

    std::size_t bit_of(const Cell& cell) const {
        const std::uint64_t mixed =
            splitmix64(std::bit_cast<std::uint64_t>(cell.x + 0.0) ^
                       splitmix64(std::bit_cast<std::uint64_t>(cell.y + 0.0) ^
                                  splitmix64(std::bit_cast<std::uint64_t>(cell.z + 0.0))));
        return static_cast<std::size_t>(mixed) & (words_.size() * 64 - 1);
    }

    double cell_;
    std::vector<std::uint64_t> words_;
};

std::vector<TaggedPoint> points_near(std::span<const TaggedPoint> centres,
                                     std::span<const TaggedPoint> points, double cell) {
    const NearCells cells(centres, cell);
    std::vector<TaggedPoint> near;
    std::copy_if(points.begin(), points.end(), std::back_inserter(near),
                 [&](const TaggedPoint& point) { return cells.contain(point.position); });
    return near;
}

}  // namespace

SpacingSample::SpacingSample(std::uint64_t points)
    : threshold_(points <= kAllBelow
                     ? std::numeric_limits<std::uint64_t>::max()
                     : static_cast<std::uint64_t>(
                           std::min(kSampled / static_cast<double>(points), 1 - 1e-9) * 0x1p64)) {}

bool SpacingSample::contains(PointId id) const {
    // Another hash than the one that breaks ties in the order.
    constexpr std::uint64_t kSalt = 0x5bd1e995'9e3779b9U;
    return splitmix64(id ^ kSalt) <= threshold_;
}

double SpacingSample::share() const {
    return static_cast<double>(threshold_) * 0x1p-64;
}

BrickSpacing brick_spacing(const PointBlocks& brick, const SpacingSample& sample, const Box& halo,
                           const Box& archive) {
    std::vector<std::uint8_t> centres(brick.size());
    for (std::size_t i = 0; i < brick.size(); ++i) {
        centres[i] = brick.is_core[i] != 0 && sample.contains(brick.ids[i]) ? 1 : 0;
    }
    BrickSpacing result;
    measure(brick, centres, {halo, archive, kInfinity}, result);
    return result;
}

BrickSpacing sparse_spacing(std::vector<TaggedPoint> points, const SpacingSample& sample,
                            const Box& halo, const Box& archive) {
    Box box;
    std::vector<TaggedPoint> open;
    for (const TaggedPoint& point : points) {
        box.extend(point.position);
        if (point.is_core() && sample.contains(point.id())) {
            open.push_back(point);
        }
    }
    const Vec3 size = box.size();
    const double longest = std::max({size.x, size.y, size.z});
    BrickSpacing result;
    double cell = cell_size_for(open, points);
    for (; !open.empty() && cell < longest; cell *= 8) {
        const PointBlocks near = make_blocks(points_near(open, points, cell));
        open = measure_open(near, open, {halo, archive, cell * cell}, result);
    }
    // Nothing lies outside cells that are as large as the brick.
    if (!open.empty()) {
        measure_open(make_blocks(std::move(points)), open, {halo, archive, kInfinity}, result);
    }
    return result;
}

}  // namespace knap
