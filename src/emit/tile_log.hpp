#pragma once

#include <cstddef>
#include <functional>
#include <map>

#include "knap/archive.hpp"

namespace knap {

/// The finished tiles of an unfinished archive. Without on_tile an archive that is not finished
/// leaves nothing behind.
struct TileLog {
    std::map<std::size_t, ManifestTile> done;  ///< by number, from an earlier run
    /// Told each tile once its file is in place; one call at a time.
    std::function<void(std::size_t number, const ManifestTile& tile)> on_tile = nullptr;
};

}  // namespace knap
