#include "tileset/properties.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <string_view>

#include "emit/tile_layout.hpp"

namespace knap {

namespace {

// Beside position, colour, normal and one that CesiumJS adds.
constexpr std::size_t kMostProperties = 12;
constexpr int kMostComponents = 4;

constexpr std::array<std::string_view, 8> kFlags{
    "scan_direction", "edge_of_flight_line", "synthetic",      "key_point", "withheld",
    "overlap",        "user_data",           "scanner_channel"};
constexpr std::array<std::string_view, 8> kReserved{
    "POSITION", "RGB", "RGBA", "NORMAL", "BATCH_ID", "extensions", "extras", "HIERARCHY"};

template <typename Names>
bool is_one_of(const Names& names, std::string_view name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

bool fits(const Attribute& attribute) {
    return attribute.components <= kMostComponents && attribute.type != ScalarType::kInt64 &&
           attribute.type != ScalarType::kUint64;
}

}  // namespace

PropertyPlan plan_properties(std::span<const Attribute> attributes) {
    PropertyPlan plan;
    std::vector<std::size_t> generic;
    for (const TileAttribute& group : tile_attributes(attributes, TileCoding::kCurve)) {
        if (group.kind == TileAttribute::Kind::kColor) {
            plan.color = group.members;
            plan.color_type = group.type;
        } else if (group.kind == TileAttribute::Kind::kNormal) {
            plan.normal = group.members;
        } else {
            generic.push_back(group.members.front());
        }
    }
    std::vector<std::size_t> chosen;
    for (const bool flags : {false, true}) {
        for (const std::size_t i : generic) {
            if (fits(attributes[i]) && is_one_of(kFlags, attributes[i].name) == flags &&
                chosen.size() < kMostProperties) {
                chosen.push_back(i);
            }
        }
    }
    std::sort(chosen.begin(), chosen.end());
    std::set<std::string> names;
    for (const Attribute& attribute : attributes) {
        names.insert(attribute.name);
    }
    for (const std::size_t i : generic) {
        if (!std::binary_search(chosen.begin(), chosen.end(), i)) {
            plan.left_out.push_back(attributes[i].name);
            continue;
        }
        std::string name = attributes[i].name;
        while (is_one_of(kReserved, name) || (name != attributes[i].name && names.contains(name))) {
            name += "_";
        }
        plan.properties.push_back({name, i});
    }
    return plan;
}

}  // namespace knap
