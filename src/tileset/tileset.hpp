#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace knap {

/// What making a tileset may use, and whom to tell.
struct TilesetRequest {
    int threads = 1;                 ///< >= 1; does not change the result
    std::uint64_t memory_bytes = 0;  ///< does not change the result
    bool overwrite = false;          ///< replace a tileset that is there
    /// Told points done with, from any thread; may throw to stop the work.
    std::function<void(std::uint64_t)> advance = [](std::uint64_t) {};
};

struct TilesetResult {
    std::uint64_t tiles = 0;
    std::uint64_t points = 0;
    std::uint64_t bytes = 0;   ///< of all files
    bool on_earth = false;     ///< placed by the coordinate system; else in a frame of its own
    double largest_error = 0;  ///< by which a point may be off, metres or cloud units
    std::vector<std::string> notes;  ///< what the tileset cannot say, for people
};

/// Writes 3D Tiles of an archive, into `tileset` in its folder: tileset.json and .pnts files with
/// the extension 3DTILES_draco_point_compression (docs/formats.md). Every point of the archive is
/// in exactly one tile; a parent has an even sample of the points below it. Where the archive's
/// coordinate system is known the tileset stands on the Earth (EPSG:4978).
///
/// One tile of the archive a thread is in memory at a time, and what open tiles above it have.
///
/// @param archive  its folder
/// @throws ConfigError  if there is a tileset, and it is not to be replaced
/// @throws InputError   if the archive is missing or damaged
/// @throws StorageError if the disk is full or fails; what was there is untouched then
TilesetResult make_tileset(const std::filesystem::path& archive, const TilesetRequest& request);

}  // namespace knap
