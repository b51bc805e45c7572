#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "knap/geometry.hpp"
#include "merge/region.hpp"

namespace knap {

/// The kept points and their regions, indexed so that "is this point marked?" costs about the same
/// at any size: a few levels of hashed grid, one look-up a level.
///
/// A point of reach r stands on the level whose cells are 2 r to 4 r wide, in every cell that its
/// ball touches (eight, seldom more). A query looks into the one cell that holds it on each level.
/// Ranges far below what the coordinates resolve share one level.
class Coverage {
  public:
    /// @param box  of all points that will be asked for
    /// @param shape  of the regions
    explicit Coverage(const Box& box, const RegionShape& shape = {});

    /// Marks every point within `range` of `centre`, if regions are balls.
    /// @param range  > 0, cloud units; may be infinite
    void add(const Vec3& centre, double range);

    /// Marks every point of a region.
    void add(const Vec3& centre, const Region& region);

    /// True if p is in the region of a centre added before: |p - centre|^2 <= reach^2, and holds().
    /// Thread-safe while nothing is added.
    bool marks(const Vec3& p) const;

    std::uint64_t size() const { return centres_.size(); }
    std::uint64_t memory_bytes() const;

  private:
    struct Centre {
        Vec3 position;
        double squared_reach;
    };

    // As many entries as fill a cache line.
    struct Block {
        std::uint32_t next;  // 0: the last one; else 1 + its place in `blocks`
        std::uint32_t count;
        std::array<std::uint32_t, 14> centres;
    };

    // A hash table of cells without keys: cells that share a bucket share its list, which costs
    // time but changes nothing, since every candidate is measured.
    struct Level {
        double cells_per_unit = 0;
        std::vector<std::uint32_t> members;  // all centres of the level, each once
        std::vector<std::uint32_t> heads;    // a power of two of them; 0: empty; else 1 + a block
        std::vector<Block> blocks;
        std::uint64_t entries = 0;
    };

    void add_ball(const Vec3& centre, double reach);
    Level& level_for(double reach);
    void insert(Level& level, std::uint32_t centre) const;
    void grow(Level& level) const;

    Box box_;
    RegionShape shape_;
    double smallest_cell_ = 0;
    bool everything_ = false;
    std::vector<Centre> centres_;
    std::vector<Region> regions_;  // of each centre; none if they are balls
    std::vector<Level> levels_;    // the level used last first
};

}  // namespace knap
