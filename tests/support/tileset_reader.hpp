#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "knap/geometry.hpp"

/// 3D Tiles as their specification reads, without a line of knap's own code for them.
namespace knap::test {

struct TilesetPoint {
    Vec3 place;                         ///< in the coordinates above the root
    std::array<std::uint8_t, 3> rgb{};  ///< zeros where a file has none
    double value = 0;                   ///< of the property that was asked for
};

struct ReadTileset {
    nlohmann::json json;
    std::vector<TilesetPoint> points;
    std::size_t files = 0;
    std::size_t floats = 0;               ///< points whose positions are not quantised
    std::vector<std::string> faults;      ///< what the specification forbids
    std::vector<std::string> properties;  ///< of the first file
};

/// Reads a tileset with all its files.
/// @param property  of the batch table, a scalar; empty: none
ReadTileset read_tileset(const std::filesystem::path& folder, const std::string& property);

}  // namespace knap::test
