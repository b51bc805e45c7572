#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

#include "knap/source.hpp"

namespace draco {
class PointCloud;
}

namespace knap {

/// Names of the metadata by which an attribute of a Draco file of knap tells what its values are.
/// One without them is as Draco has it.
namespace draco_keys {
inline constexpr const char* kAttributeName = "name";       // string
inline constexpr const char* kAttributeType = "type";       // string: "int8" .. "float64"
inline constexpr const char* kAttributeScale = "scale";     // double; absent: 1
inline constexpr const char* kAttributeOffset = "offset";   // double; absent: 0
inline constexpr const char* kDescription = "description";  // string; absent: empty
// Of each component two 32-bit halves of the bits of a value, the lower one first; absent: not
// said.
inline constexpr std::array<std::pair<const char*, std::vector<std::uint64_t> ValueLimits::*>, 3>
    kLimits{{{"missing", &ValueLimits::missing},
             {"least", &ValueLimits::least},
             {"greatest", &ValueLimits::greatest}}};
}  // namespace draco_keys

/// What the points of a Draco file carry beside their position.
struct DracoColumns {
    std::vector<Attribute> attributes;           ///< names are unique
    std::vector<std::vector<std::byte>> values;  ///< of each, of all points in the order stored
};

/// All attributes but positions. A colour is red, green, blue (and alpha), a normal nx, ny, nz; a
/// generic attribute has the name that its metadata gives it, or "generic". Values that are stored
/// in parts are put together.
/// @param file  named in errors
/// @throws InputError if the metadata contradicts what is stored
DracoColumns draco_columns(const draco::PointCloud& cloud, const std::filesystem::path& file);

}  // namespace knap
