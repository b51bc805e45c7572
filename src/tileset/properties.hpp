#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "knap/source.hpp"

namespace knap {

/// How a tileset carries what the points of an archive carry.
struct PropertyPlan {
    std::vector<std::size_t> color;  ///< red, green, blue among the archive's attributes, or none
    ScalarType color_type = ScalarType::kUint8;
    std::vector<std::size_t> normal;  ///< nx, ny, nz, or none

    /// A property of the batch table.
    struct Property {
        std::string name;  ///< that of the attribute, but for those that mean something else
        std::size_t attribute = 0;  ///< among the archive's
    };
    std::vector<Property> properties;
    std::vector<std::string> left_out;  ///< names of attributes that are not carried
};

/// Colours and normals as features; of the others, those that a batch table can hold (numbers of up
/// to 32 bits and doubles, up to four a point) and that a viewer still loads: CesiumJS has 16
/// attributes a point in all. The flags of LAS go last.
PropertyPlan plan_properties(std::span<const Attribute> attributes);

}  // namespace knap
