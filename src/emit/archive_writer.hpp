#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "base/memory_gate.hpp"
#include "emit/draco_tile.hpp"
#include "emit/lattice.hpp"
#include "emit/output_folder.hpp"
#include "emit/tile_layout.hpp"
#include "emit/tile_log.hpp"
#include "emit/tiles.hpp"
#include "knap/archive.hpp"
#include "knap/params.hpp"

namespace knap {

/// Where an archive goes and what writing it may use.
struct ArchiveOutput {
    std::filesystem::path folder;
    std::uint64_t tile_points = 0;  ///< most points in a tile, >= 1
    bool overwrite = false;         ///< replace an archive that exists
    TileEncoding encoding = TileEncoding::kAuto;
    int threads = 1;     ///< >= 1
    TileLog tiles = {};  ///< of this output, from an earlier run
    /// Told when all but the folder's name is there: the folder, tiles, bytes.
    std::function<void(const std::filesystem::path&, std::uint64_t, std::uint64_t)> on_whole =
        nullptr;
    /// Called now and then, from any thread; may throw to stop the work.
    std::function<void()> poll = [] {};
};

/// Writes an archive: the tiles, then the manifest, then the folder's name. A tile that an earlier
/// run has left whole is not encoded again.
class ArchiveWriter {
  public:
    /// @param manifest  all but `tiles` and `box`; what is on its lattice is to be added
    /// @throws StorageError if the folder cannot be made
    ArchiveWriter(Manifest manifest, ArchiveOutput output);

    /// Cuts points into tiles and encodes them, several at a time. The tiles follow those that
    /// were added before.
    /// @param points        reordered
    /// @param memory_bytes  for encoding, the points not counted; does not change the result
    /// @throws StorageError if the disk is full or fails
    void add(std::span<LatticeIndex> points, std::uint64_t memory_bytes);

    /// The same for points that carry the manifest's attributes.
    /// @param rows  one for each number that a point names, as AttributePlan has them
    void add(std::span<CarryingPoint> points, std::span<const std::byte> rows,
             std::uint64_t memory_bytes);

    /// @return bytes of all files
    /// @throws StorageError
    std::uint64_t finish();

    std::uint64_t tiles() const { return manifest_.tiles.size(); }

  private:
    /// The points of a planned tile with their rows, in memory of its own where it has to be.
    struct Content {
        std::vector<LatticeIndex> points;
        std::vector<std::byte> rows;
        TilePoints tile;
    };
    using GetContent = std::function<Content(const TileSpan& span)>;

    void write_tiles(std::span<const TileSpan> plan, const GetContent& content,
                     std::uint64_t memory_bytes);
    ManifestTile tile(std::size_t number, const TileSpan& span, const GetContent& content) const;
    ManifestTile write_tile(std::size_t number, const TileSpan& span,
                            const GetContent& content) const;
    TileCoding choose_coding(const TileSpan& first, const GetContent& content,
                             MemoryGate& gate) const;

    Manifest manifest_;
    TileFormat format_;
    std::optional<TileCoding> coding_;  // of all tiles; none before the first is known
    ArchiveOutput output_;
    OutputFolder folder_;
    std::mutex mutex_;
};

}  // namespace knap
