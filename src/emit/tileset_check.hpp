#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "knap/archive.hpp"

namespace knap {

/// What a look at a tileset found.
struct TilesetCheck {
    std::vector<std::string> files;  ///< relative to the archive; none: there is no tileset
    std::uint64_t tiles = 0;
    std::uint64_t bytes = 0;  ///< of the tiles
};

/// Checks the 3D Tiles in an archive, if there are any: that they were made of it, the checksum of
/// tileset.json, size and checksum of each file, and that they hold all kept points.
/// @throws InputError naming the first file that is wrong
TilesetCheck check_tileset(const std::filesystem::path& archive, const Manifest& manifest);

}  // namespace knap
