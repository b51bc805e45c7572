#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "emit/lattice.hpp"
#include "emit/tile_layout.hpp"
#include "input/draco_reader.hpp"
#include "knap/archive.hpp"

namespace knap {

/// What all tiles of an output have in common.
struct TileFormat {
    Lattice lattice;
    std::string crs;                    ///< WKT or "EPSG:n"; empty if there is none
    std::vector<Attribute> attributes;  ///< that each point has a row of, as AttributePlan has it
};

/// The points of a tile and what they carry.
struct TilePoints {
    std::span<const LatticeIndex> points;  ///< up to 2^31 - 1, in the order of the sources
    std::span<const std::byte> rows;       ///< one a point; none if the format has no attributes
    LatticeIndex origin{};  ///< where the tile begins: no point is below, sides below 2^kTileBits
};

/// A tile as Draco holds it, back on the lattice.
struct DecodedTile {
    Lattice lattice;
    LatticeIndex origin{};             ///< lattice index of the local (0, 0, 0)
    std::vector<LatticeIndex> points;  ///< in the order stored
    DracoColumns columns;              ///< of the same points
    std::string crs;
};

/// Encodes points as a Draco file: float positions local to the tile's origin, quantised so that
/// the stored integers are the lattice steps, and attributes without loss. Lattice, origin, CRS and
/// what attributes are travel in its metadata.
///
/// The result is decoded again before it is returned, so a tile that is written can be read.
///
/// @throws StorageError if Draco fails or does not give the points back
std::vector<std::byte> encode_tile(const TilePoints& tile, const TileFormat& format,
                                   TileCoding coding);

/// Bytes that encode_tile() would give.
/// @throws StorageError if Draco fails
std::size_t encoded_size(const TilePoints& tile, const TileFormat& format, TileCoding coding);

/// Encodes in each way that an encoding may stand for, and gives the smallest.
std::vector<std::byte> encode_smallest(const TilePoints& tile, const TileFormat& format,
                                       TileEncoding encoding);

/// The same for points that carry nothing.
/// @param points  sorted
std::vector<std::byte> encode_tile(std::span<const LatticeIndex> points, const LatticeIndex& origin,
                                   const Lattice& lattice, const std::string& crs);

/// Decodes what encode_tile() returned.
/// @param file  named in errors
/// @throws InputError if it is not that
DecodedTile decode_tile(std::span<const std::byte> bytes, const std::filesystem::path& file);

/// Puts a Draco cloud back on its lattice.
/// @param cloud  with a lattice
/// @param file   named in errors
/// @throws InputError if a coordinate is not finite or far off any lattice
DecodedTile on_lattice(DracoCloud cloud, const std::filesystem::path& file);

/// Memory that encoding a tile takes, its points and rows not counted.
std::uint64_t encode_memory_bytes(std::uint64_t points, std::span<const Attribute> attributes = {});

}  // namespace knap
