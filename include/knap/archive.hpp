#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "knap/export.hpp"
#include "knap/geometry.hpp"
#include "knap/job.hpp"

namespace knap {

/// The integer lattice that all positions of an archive lie on: position = origin + index * step.
struct Lattice {
    Vec3 origin;      ///< cloud units
    double step = 0;  ///< cloud units, > 0, the same on every axis
};

/// One source as the manifest names it.
struct ManifestSource {
    std::string path;  ///< as the job gave it
    std::string format;
    std::uint64_t points = 0;
    std::uint64_t rejected = 0;
    std::uint64_t bytes = 0;
    std::string xxh3;  ///< XXH3-128 of the file, 32 hex digits
    CoordinateFormat coordinates;
    std::vector<Attribute> schema;
    std::string crs;                                  ///< WKT or "EPSG:n"; empty if none
    std::optional<LasHeaderInfo> las = std::nullopt;  ///< LAS and LAZ: header and records
};

/// One tile as the manifest names it.
struct ManifestTile {
    std::string file;  ///< relative to the archive: "tiles/000000.drc"
    std::uint64_t points = 0;
    Box box;                               ///< of the tile's points on the lattice, cloud units
    std::array<std::int64_t, 3> origin{};  ///< lattice index of the tile's local (0, 0, 0)
    std::uint64_t bytes = 0;
    std::string xxh3;  ///< XXH3-64 of the file, 16 hex digits
};

/// manifest.json, written last: an archive without one is not an archive. See docs/formats.md.
struct Manifest {
    int format_version = 1;
    std::string knap_version;
    std::vector<std::pair<std::string, std::string>>
        parameters;  ///< key and value of all that shape the result
    std::vector<ManifestSource> sources;
    Counts counts;
    double spacing = 0;         ///< cloud units
    double mean_curvature = 0;  ///< 1 / cloud unit
    Lattice lattice;
    Box box;                            ///< of the kept points on the lattice
    std::string crs;                    ///< of the archive: the sources', if they agree
    std::vector<Attribute> attributes;  ///< what points carry beside their position
    std::vector<ManifestTile> tiles;
};

/// The points of a tile and what they carry.
struct Tile {
    std::vector<Vec3> positions;  ///< cloud units, on the lattice, in the order they are stored
    /// One for each of the manifest's attributes: the values of positions[i] are at
    /// [i * value_size, (i + 1) * value_size), in the byte order of this machine.
    std::vector<std::vector<std::byte>> columns;
};

/// What verify() found.
struct Verification {
    std::uint64_t tiles = 0;
    std::uint64_t points = 0;
    std::uint64_t bytes = 0;
    std::uint64_t tileset_tiles = 0;  ///< of the 3D Tiles in the archive, if there are any
    std::uint64_t tileset_bytes = 0;
};

/// A finished archive on disk.
class KNAP_API Archive {
  public:
    /// @throws InputError if the folder has no manifest, or it is malformed or of a newer version
    explicit Archive(const std::filesystem::path& folder);

    const Manifest& manifest() const { return manifest_; }
    const std::filesystem::path& folder() const { return folder_; }

    /// Positions of one tile, cloud units, on the lattice, in the order they are stored.
    /// @param tile  index into manifest().tiles
    /// @throws InputError if the file is missing, fails its checksum or does not decode
    std::vector<Vec3> read_tile(std::size_t tile) const;

    /// The same with all attributes.
    /// @throws InputError also if the attributes in the file are not those of the manifest
    Tile read_whole_tile(std::size_t tile) const;

    /// Checks every checksum, count, box and decodes every tile; the checksums of 3D
    /// Tiles, if there are any. Files that neither of them names are an error too.
    /// @throws InputError naming the first file that is wrong
    Verification verify() const;

  private:
    std::filesystem::path folder_;
    Manifest manifest_;
};

}  // namespace knap
