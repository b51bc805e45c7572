#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "input/draco_reader.hpp"
#include "knap/source.hpp"

namespace knap {

/// The points of one Draco file, decoded.
struct TileContent {
    std::vector<Vec3> positions;
    /// One for each attribute of the source, in the order of its schema without coordinates.
    std::vector<std::vector<std::byte>> columns;
};

/// Decodes a tile.
/// @throws InputError if it is missing or damaged
using LoadTile = std::function<TileContent(std::size_t tile)>;

/// Whole lattice steps that the positions of a tile lie at.
/// @throws InputError if they are not on its lattice
std::vector<std::array<std::int64_t, 3>> lattice_indices(const DracoCloud& cloud,
                                                         const std::filesystem::path& file);

/// Where whole steps lie, as an archive has it: index * step + origin.
Vec3 lattice_position(const Vec3& origin, double step, const std::array<std::int64_t, 3>& index);

/// The form in which such positions are kept in 32 bits an axis, bit for bit; doubles if there is
/// none.
/// @param low, high  smallest and largest index on each axis; low > high: there are no points
CoordinateFormat format_of_lattice(const Vec3& origin, double step,
                                   const std::array<std::int64_t, 3>& low,
                                   const std::array<std::int64_t, 3>& high);

/// Three columns of coordinates, and these attributes behind them.
std::vector<Attribute> schema_of_tiles(ScalarType coordinates,
                                       std::span<const Attribute> attributes);

/// A source whose points come in tiles, one of which is in memory at a time.
/// @param info         its schema as schema_of_tiles() gave it
/// @param tile_points  of each tile
std::unique_ptr<PointSource> open_tiles(SourceInfo info,
                                        const std::vector<std::uint64_t>& tile_points,
                                        LoadTile load);

}  // namespace knap
