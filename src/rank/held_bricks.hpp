#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace knap {

/// Bricks whose blocks stay in memory from one pass over them to the next: the first ones, as many
/// as leave room for the largest ones in work.
struct HeldBricks {
    std::size_t count = 0;
    std::uint64_t bytes = 0;
};

/// @param points   of each brick, core and halo
/// @param threads  bricks in work at a time, >= 1
/// @param budget_bytes  for what is held and what is in work
HeldBricks held_bricks(std::span<const std::uint64_t> points, int threads,
                       std::uint64_t budget_bytes);

/// Bytes of memory that a point of a brick (core or halo) takes while the brick is ranked.
std::uint64_t rank_bytes_per_point();

}  // namespace knap
