#pragma once

#include <cstdint>

#include "emit/archive_writer.hpp"
#include "emit/emit.hpp"
#include "emit/kept_points.hpp"
#include "emit/lattice.hpp"

namespace knap {

/// Removes what an earlier run, or this one, has left of kept points on disk.
void remove_kept_files(const std::filesystem::path& scratch);

/// Cuts kept points that the memory does not hold into tiles: halved on disk until a part fits.
/// @param capacity  points that may be held in memory at a time, >= 2
void write_tiles_through_scratch(const KeptPoints& kept, const Lattice& lattice,
                                 std::uint64_t capacity, const EmitRequest& request,
                                 ArchiveWriter& writer);

}  // namespace knap
