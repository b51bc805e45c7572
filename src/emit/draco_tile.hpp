#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "emit/lattice.hpp"
#include "input/draco_reader.hpp"
#include "knap/archive.hpp"

namespace knap {

/// A tile as Draco holds it, back on the lattice.
struct DecodedTile {
    Lattice lattice;
    LatticeIndex origin{};             ///< lattice index of the local (0, 0, 0)
    std::vector<LatticeIndex> points;  ///< in the order stored
    std::string crs;
};

/// Encodes points as a Draco file: kd-tree, float positions local to `origin`, quantised so that
/// the stored integers are the lattice steps. Lattice, origin and CRS travel in its metadata.
///
/// The result is decoded again before it is returned, so a tile that is written can be read.
///
/// @param points  up to 2^31 - 1, sorted, from `origin` on, sides below 2^kTileBits steps
/// @param crs     WKT or "EPSG:n"; empty if there is none
/// @throws StorageError if Draco fails or does not give the points back
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
DecodedTile on_lattice(const DracoCloud& cloud, const std::filesystem::path& file);

/// Memory that encoding a tile takes, its points not counted.
std::uint64_t encode_memory_bytes(std::uint64_t points);

}  // namespace knap
