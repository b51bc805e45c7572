#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "knap/geometry.hpp"
#include "knap/source.hpp"

namespace knap {

/// Names of the folder of 3D Tiles in an archive, and of the file that viewers open.
inline constexpr std::string_view kTilesetFolder = "tileset";
inline constexpr std::string_view kTilesetName = "tileset.json";

/// A file of points of a tileset.
struct TilesetContent {
    std::string file;  ///< in the folder: "000000.pnts"
    std::uint64_t points = 0;
    std::uint64_t bytes = 0;
    std::string xxh3;  ///< XXH3-64 of the file, 16 hex digits
};

/// A tile of a tileset.
struct TilesetNode {
    std::array<double, 16> transform{};  ///< to the parent's coordinates, column behind column
    Box box;                             ///< of all points below, in its own coordinates
    double geometric_error = 0;          ///< metres, or cloud units
    TilesetContent content;              ///< none: of no file
    std::vector<std::size_t> children;
};

/// tileset.json: what viewers read, and what knap keeps of where it comes from.
struct Tileset {
    std::string knap_version;
    std::string archive;  ///< XXH3-64 of the archive's manifest.json, 16 hex digits
    std::uint64_t points = 0;
    std::string frame;      ///< "ECEF" or "local"
    std::string crs;        ///< of the archive
    std::string operation;  ///< by which PROJ puts points on the Earth; empty if local
    double largest_error =
        0;  ///< by which a point is off where the coordinate system has it, metres
    std::vector<Attribute> attributes;  ///< of the batch tables
    double geometric_error = 0;
    std::vector<TilesetNode> nodes;  ///< the root first; none: no points
};

/// As JSON text, the same bytes for the same tileset.
std::string format_tileset(const Tileset& tileset);

/// What `folder`/tileset.json names, and what it is made of.
struct TilesetIndex {
    std::string archive;
    std::uint64_t points = 0;
    std::string frame;
    std::vector<TilesetContent> contents;

    std::uint64_t bytes() const;  ///< of all contents
};

/// @throws InputError naming file and key if it is none of knap's, or damaged
TilesetIndex read_tileset_index(const std::filesystem::path& folder);

/// That of an archive, if it has 3D Tiles.
/// @throws InputError as above
std::optional<TilesetIndex> find_tileset(const std::filesystem::path& archive);

}  // namespace knap
