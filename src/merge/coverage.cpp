#include "merge/coverage.hpp"

#include <algorithm>
#include <cmath>

namespace knap {

namespace {

constexpr std::size_t kFirstBuckets = 1024;
// Far above the rounding of a range's square and of a cell's faces.
constexpr double kPadding = 1 + 1e-9;
constexpr double kRounding = 1e-14;
// Smallest cell over the largest coordinate: far above kRounding, or else the rounding of a centre
// would spread it over any number of cells.
constexpr double kSmallestCell = 0x1p-36;
constexpr int kSmallestExponent = -1000;
constexpr std::uint64_t kEntriesPerBucket = 4;

struct Cell {
    std::int64_t x;
    std::int64_t y;
    std::int64_t z;
};

// floor(coordinate / cell size): monotone in the coordinate, since cell sizes are powers of two. No
// cell is so small that the quotient leaves 64 bits.
std::int64_t cell_index(double coordinate, double cells_per_unit) {
    const double quotient = coordinate * cells_per_unit;
    const auto truncated = static_cast<std::int64_t>(quotient);
    return truncated - (quotient < static_cast<double>(truncated) ? 1 : 0);
}

Cell cell_of(const Vec3& p, double cells_per_unit) {
    return {cell_index(p.x, cells_per_unit), cell_index(p.y, cells_per_unit),
            cell_index(p.z, cells_per_unit)};
}

// Cells of a 4 x 4 x 4 block share a stretch of 64 buckets, so that neighbours are near in memory.
std::size_t bucket_of(const Cell& cell, std::size_t buckets) {
    constexpr std::uint64_t kSpreadX = 0x9e3779b97f4a7c15U;
    constexpr std::uint64_t kSpreadY = 0xbf58476d1ce4e5b9U;
    constexpr std::uint64_t kSpreadZ = 0x94d049bb133111ebU;
    std::uint64_t block = static_cast<std::uint64_t>(cell.x >> 2) * kSpreadX +
                          static_cast<std::uint64_t>(cell.y >> 2) * kSpreadY +
                          static_cast<std::uint64_t>(cell.z >> 2) * kSpreadZ;
    block = (block ^ (block >> 32)) * kSpreadX;
    block ^= block >> 32;
    const auto inside =
        static_cast<std::uint64_t>((cell.x & 3) | (cell.y & 3) << 2 | (cell.z & 3) << 4);
    return static_cast<std::size_t>((block << 6 | inside) & (buckets - 1));
}

}  // namespace

Coverage::Coverage(const Box& box, const RegionShape& shape) : box_(box), shape_(shape) {
    if (!box.empty()) {
        for (const Vec3& corner : {box.min, box.max}) {
            smallest_cell_ =
                std::max({smallest_cell_, std::abs(corner.x) * kSmallestCell,
                          std::abs(corner.y) * kSmallestCell, std::abs(corner.z) * kSmallestCell});
        }
    }
}

void Coverage::add(const Vec3& centre, double range) {
    add_ball(centre, range);
}

void Coverage::add(const Vec3& centre, const Region& region) {
    if (!shape_.is_ball()) {
        regions_.push_back(region);
    }
    add_ball(centre, region.reach);
}

void Coverage::add_ball(const Vec3& centre, double reach) {
    const auto index = static_cast<std::uint32_t>(centres_.size());
    const Vec3 size = box_.size();
    const double all_squared = (size.x * size.x + size.y * size.y + size.z * size.z) * kPadding;
    if (reach * reach >= all_squared && shape_.is_ball()) {
        centres_.push_back({centre, reach * reach});
        everything_ = true;
        return;
    }
    // No cell need be larger than what reaches everything.
    centres_.push_back({centre, std::min(reach * reach, all_squared)});
    Level& level = level_for(std::min(reach, std::sqrt(all_squared)));
    level.members.push_back(index);
    if (level.entries >= level.heads.size() * kEntriesPerBucket) {
        grow(level);
    } else {
        insert(level, index);
    }
}

Coverage::Level& Coverage::level_for(double reach) {
    // reach = f * 2^e with f in [0.5, 1), so cells of 2^(e + 1) are 2 to 4 reaches wide.
    int exponent = 0;
    std::frexp(std::max(reach, smallest_cell_ / 2), &exponent);
    // The inverse of every power of two down to this one is a power of two as well.
    const double cells_per_unit = std::ldexp(1.0, -std::max(exponent + 1, kSmallestExponent));
    const auto known = std::find_if(levels_.begin(), levels_.end(), [&](const Level& level) {
        return level.cells_per_unit == cells_per_unit;
    });
    if (known != levels_.end()) {
        return *known;
    }
    // Ranges grow along the order, so the newest level is the likeliest to mark.
    Level level;
    level.cells_per_unit = cells_per_unit;
    level.heads.resize(kFirstBuckets);
    return *levels_.insert(levels_.begin(), std::move(level));
}

void Coverage::insert(Level& level, std::uint32_t centre) const {
    const Vec3& p = centres_[centre].position;
    const double reach = std::sqrt(centres_[centre].squared_reach) * kPadding;
    const auto padded = [&](double c) { return reach + std::abs(c) * kRounding; };
    const Cell low =
        cell_of({p.x - padded(p.x), p.y - padded(p.y), p.z - padded(p.z)}, level.cells_per_unit);
    const Cell high =
        cell_of({p.x + padded(p.x), p.y + padded(p.y), p.z + padded(p.z)}, level.cells_per_unit);
    for (std::int64_t x = low.x; x <= high.x; ++x) {
        for (std::int64_t y = low.y; y <= high.y; ++y) {
            for (std::int64_t z = low.z; z <= high.z; ++z) {
                std::uint32_t& head = level.heads[bucket_of({x, y, z}, level.heads.size())];
                if (head == 0 ||
                    level.blocks[head - 1].count == level.blocks[head - 1].centres.size()) {
                    level.blocks.push_back({head, 0, {}});
                    head = static_cast<std::uint32_t>(level.blocks.size());
                }
                Block& block = level.blocks[head - 1];
                block.centres[block.count++] = centre;
                ++level.entries;
            }
        }
    }
}

// Four times the buckets, and all members into them anew.
void Coverage::grow(Level& level) const {
    level.heads.assign(level.heads.size() * 4, 0);
    level.blocks.clear();
    level.entries = 0;
    for (const std::uint32_t member : level.members) {
        insert(level, member);
    }
}

bool Coverage::marks(const Vec3& p) const {
    if (everything_) {
        return true;
    }
    for (const Level& level : levels_) {
        const std::size_t bucket = bucket_of(cell_of(p, level.cells_per_unit), level.heads.size());
        for (std::uint32_t at = level.heads[bucket]; at != 0; at = level.blocks[at - 1].next) {
            const Block& block = level.blocks[at - 1];
            for (std::uint32_t i = 0; i < block.count; ++i) {
                const std::uint32_t index = block.centres[i];
                const Centre& centre = centres_[index];
                if (squared_distance(p, centre.position) <= centre.squared_reach &&
                    (regions_.empty() || holds(regions_[index], shape_, p - centre.position))) {
                    return true;
                }
            }
        }
    }
    return false;
}

std::uint64_t Coverage::memory_bytes() const {
    std::uint64_t bytes =
        centres_.capacity() * sizeof(Centre) + regions_.capacity() * sizeof(Region);
    for (const Level& level : levels_) {
        bytes += (level.members.capacity() + level.heads.capacity()) * sizeof(std::uint32_t) +
                 level.blocks.capacity() * sizeof(Block);
    }
    return bytes;
}

}  // namespace knap
