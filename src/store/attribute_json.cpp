#include "store/attribute_json.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/scalar.hpp"

namespace knap {

namespace {

constexpr std::array kScalarTypes{ScalarType::kInt8,   ScalarType::kUint8,  ScalarType::kInt16,
                                  ScalarType::kUint16, ScalarType::kInt32,  ScalarType::kUint32,
                                  ScalarType::kInt64,  ScalarType::kUint64, ScalarType::kFloat32,
                                  ScalarType::kFloat64};
constexpr std::array<std::pair<const char*, std::vector<std::uint64_t> ValueLimits::*>, 3> kLimits{
    {{"missing", &ValueLimits::missing},
     {"least", &ValueLimits::least},
     {"greatest", &ValueLimits::greatest}}};

Json limits_json(ScalarType type, const std::vector<std::uint64_t>& values) {
    Json json = Json::array();
    for (const std::uint64_t bits : values) {
        visit_scalar(type, [&](auto tag) {
            using T = typename decltype(tag)::Type;
            if constexpr (std::is_floating_point_v<T>) {
                json.push_back(number_json(std::bit_cast<double>(bits)));
            } else if constexpr (std::is_signed_v<T>) {
                json.push_back(std::bit_cast<std::int64_t>(bits));
            } else {
                json.push_back(bits);
            }
        });
    }
    return json;
}

std::vector<std::uint64_t> limits_from(ScalarType type, int components, const JsonNode& node) {
    std::vector<std::uint64_t> values;
    for (const JsonNode& item : node.items(static_cast<std::size_t>(components))) {
        visit_scalar(type, [&](auto tag) {
            using T = typename decltype(tag)::Type;
            if constexpr (std::is_floating_point_v<T>) {
                constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
                values.push_back(
                    std::bit_cast<std::uint64_t>(item.is_nan() ? kNan : item.number()));
            } else if constexpr (std::is_signed_v<T>) {
                values.push_back(std::bit_cast<std::uint64_t>(item.integer()));
            } else {
                values.push_back(item.count());
            }
        });
    }
    return values;
}

void add_limits(Json& json, const Attribute& attribute) {
    for (const auto& [key, list] : kLimits) {
        if (!(attribute.limits.*list).empty()) {
            json[key] = limits_json(attribute.type, attribute.limits.*list);
        }
    }
}

ScalarType scalar_type(const JsonNode& node) {
    for (const ScalarType type : kScalarTypes) {
        if (node.text() == to_string(type)) {
            return type;
        }
    }
    node.fail("a scalar type", node.text());
}

}  // namespace

Json attribute_json(const Attribute& attribute) {
    Json json{{"name", attribute.name},
              {"type", to_string(attribute.type)},
              {"components", attribute.components}};
    if (attribute.scale != 1) {
        json["scale"] = number_json(attribute.scale);
    }
    if (attribute.offset != 0) {
        json["offset"] = number_json(attribute.offset);
    }
    if (!attribute.description.empty()) {
        json["description"] = attribute.description;
    }
    add_limits(json, attribute);
    return json;
}

Json attributes_json(std::span<const Attribute> attributes) {
    Json list = Json::array();
    for (const Attribute& attribute : attributes) {
        Json json{{"name", attribute.name},
                  {"type", to_string(attribute.type)},
                  {"components", attribute.components},
                  {"scale", number_json(attribute.scale)},
                  {"offset", number_json(attribute.offset)},
                  {"description", attribute.description}};
        add_limits(json, attribute);
        list.push_back(std::move(json));
    }
    return list;
}

Attribute attribute_from(const JsonNode& node) {
    const std::int64_t components = node.at("components").integer();
    if (components < 1 || components > std::numeric_limits<int>::max()) {
        node.at("components").fail("at least 1", fmt::to_string(components));
    }
    Attribute attribute{node.at("name").text(), scalar_type(node.at("type")),
                        static_cast<int>(components)};
    if (node.has("scale")) {
        attribute.scale = node.at("scale").number();
    }
    if (node.has("offset")) {
        attribute.offset = node.at("offset").number();
    }
    if (node.has("description")) {
        attribute.description = node.at("description").text();
    }
    for (const auto& [key, list] : kLimits) {
        if (node.has(key)) {
            attribute.limits.*list =
                limits_from(attribute.type, attribute.components, node.at(key));
        }
    }
    return attribute;
}

}  // namespace knap
