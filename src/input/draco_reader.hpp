#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "input/draco_attributes.hpp"
#include "knap/geometry.hpp"
#include "knap/source.hpp"

namespace knap {

/// Names of the metadata by which a Draco file of knap tells where its lattice lies.
namespace draco_keys {
inline constexpr const char* kVersion = "knap.version";         // int32
inline constexpr const char* kOrigin = "knap.origin";           // 3 doubles, cloud units
inline constexpr const char* kStep = "knap.step";               // double, cloud units
inline constexpr const char* kTileOrigin = "knap.tile_origin";  // 3 doubles, whole lattice steps
inline constexpr const char* kCrs = "knap.crs";                 // string; absent if there is none
}  // namespace draco_keys

/// Newest version of that metadata.
inline constexpr std::int32_t kDracoLatticeVersion = 1;

/// Where the local coordinates of a tile lie: position = origin + (tile_origin + index) * step with
/// index = local / step, rounded.
struct DracoLattice {
    Vec3 origin;                                       ///< cloud units
    double step = 0;                                   ///< cloud units, > 0
    std::array<std::int64_t, 3> tile_origin{0, 0, 0};  ///< lattice steps, below 2^53
    std::string crs;                                   ///< WKT or "EPSG:n"; empty if none
};

/// What a Draco file holds.
struct DracoCloud {
    std::vector<Vec3> positions;  ///< as stored, in the order stored
    CoordinateKind kind =
        CoordinateKind::kFloat32;         ///< kFloat32 where floats hold them, else kFloat64
    DracoColumns columns;                 ///< of the same points
    std::optional<DracoLattice> lattice;  ///< none if knap did not write the file
};

/// Decodes a Draco point cloud, or the vertices of a mesh.
/// @param file  named in errors
/// @throws InputError if the bytes are not Draco, are damaged or hold no positions
DracoCloud decode_draco(std::span<const std::byte> bytes, const std::filesystem::path& file);

/// Reads a Draco file.
/// @throws InputError as decode_draco(), or if the file cannot be read
DracoCloud read_draco(const std::filesystem::path& file);

}  // namespace knap
