#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "emit/lattice.hpp"
#include "knap/archive.hpp"

namespace knap {

/// Where an archive goes and what writing it may use.
struct ArchiveOutput {
    std::filesystem::path folder;
    std::uint64_t tile_points = 0;   ///< most points in a tile, >= 1
    bool overwrite = false;          ///< replace an archive that exists
    std::uint64_t memory_bytes = 0;  ///< for encoding, the points not counted
    int threads = 1;                 ///< >= 1
};

/// Cuts the points into tiles, encodes them in parallel and writes the archive: the tiles, then
/// the manifest, then the folder's name.
///
/// @param points    on manifest.lattice; reordered
/// @param manifest  all but `tiles` and `box`, which are set here
/// @return          bytes of all files
/// @throws StorageError if the disk is full or fails; nothing is left then
std::uint64_t write_archive(std::span<LatticeIndex> points, Manifest& manifest,
                            const ArchiveOutput& output);

}  // namespace knap
