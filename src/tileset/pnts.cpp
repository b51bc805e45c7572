#include "tileset/pnts.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "base/bytes.hpp"
#include "emit/attribute_plan.hpp"
#include "emit/tile_layout.hpp"

namespace knap {

namespace {

using Json = nlohmann::ordered_json;
using Kind = PointsAttribute::Kind;

constexpr const char* kDraco = "3DTILES_draco_point_compression";
constexpr std::size_t kAlignment = 8;
constexpr std::size_t kHeader = 28;
constexpr std::uint32_t kMagic = 0x73746e70;  // "pnts"
constexpr std::uint32_t kVersion = 1;

std::string_view component_type(ScalarType type) {
    switch (type) {
        case ScalarType::kInt8:
            return "BYTE";
        case ScalarType::kUint8:
            return "UNSIGNED_BYTE";
        case ScalarType::kInt16:
            return "SHORT";
        case ScalarType::kUint16:
            return "UNSIGNED_SHORT";
        case ScalarType::kInt32:
            return "INT";
        case ScalarType::kUint32:
            return "UNSIGNED_INT";
        case ScalarType::kFloat32:
            return "FLOAT";
        default:
            return "DOUBLE";  // plan_properties() takes no others
    }
}

std::string shape(int components) {
    return components == 1 ? "SCALAR" : "VEC" + std::to_string(components);
}

/// The values of some attributes of a point, one behind the other.
std::vector<std::byte> take(const PntsPoints& points, std::span<const Attribute> attributes,
                            const RowLayout& layout, std::span<const std::size_t> members) {
    std::vector<std::byte> values;
    for (std::size_t i = 0; i < points.positions.size(); ++i) {
        const auto row = points.rows.subspan(i * layout.row_size, layout.row_size);
        for (const std::size_t member : members) {
            const auto value = row.subspan(layout.offsets[member], attributes[member].value_size());
            values.insert(values.end(), value.begin(), value.end());
        }
    }
    return values;
}

/// Colours of 16 bits in 8.
std::vector<std::byte> narrowed(std::span<const std::byte> values, bool hold_bytes) {
    constexpr std::uint32_t kWide = 257;  // 65535 / 255
    std::vector<std::byte> bytes(values.size() / 2);
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        std::uint16_t wide = 0;
        std::memcpy(&wide, values.data() + 2 * i, sizeof wide);
        bytes[i] = static_cast<std::byte>(hold_bytes ? wide : (wide + kWide / 2) / kWide);
    }
    return bytes;
}

void pad(std::vector<std::byte>& bytes, std::size_t before, char with) {
    const std::size_t beyond = (before + bytes.size()) % kAlignment;
    bytes.resize(bytes.size() + (beyond == 0 ? 0 : kAlignment - beyond),
                 static_cast<std::byte>(with));
}

/// Padded so that what follows is aligned.
std::vector<std::byte> json_bytes(const Json& json, std::size_t before) {
    const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
    std::vector<std::byte> result(bytes.begin(), bytes.end());
    pad(result, before, ' ');
    return result;
}

/// What a tile is made of, while it is put together.
struct Parts {
    std::vector<PointsAttribute> compressed;
    std::vector<std::pair<std::string, std::size_t>> features;    // name, place in `compressed`
    std::vector<std::pair<std::string, std::size_t>> properties;  // the same
    Json batch = Json::object();
    std::vector<std::byte> batch_bytes;  // of properties that Draco does not compress
};

void add_features(Parts& parts, const PntsPoints& points, std::span<const Attribute> attributes,
                  const RowLayout& layout, const PropertyPlan& plan, bool narrow_colors) {
    const auto positions = std::as_bytes(points.positions);
    parts.compressed.push_back(
        {Kind::kPosition, ScalarType::kFloat32, 3, {positions.begin(), positions.end()}});
    parts.features.emplace_back("POSITION", 0);
    if (!plan.color.empty()) {
        std::vector<std::byte> values = take(points, attributes, layout, plan.color);
        if (plan.color_type == ScalarType::kUint16) {
            values = narrowed(values, narrow_colors);
        }
        parts.features.emplace_back("RGB", parts.compressed.size());
        parts.compressed.push_back({Kind::kColor, ScalarType::kUint8, 3, std::move(values)});
    }
    if (!plan.normal.empty()) {
        parts.features.emplace_back("NORMAL", parts.compressed.size());
        parts.compressed.push_back({Kind::kNormal, ScalarType::kFloat32, 3,
                                    take(points, attributes, layout, plan.normal)});
    }
}

void add_properties(Parts& parts, const PntsPoints& points, std::span<const Attribute> attributes,
                    const RowLayout& layout, const PropertyPlan& plan) {
    for (const PropertyPlan::Property& property : plan.properties) {
        const Attribute& attribute = attributes[property.attribute];
        std::vector<std::byte> values =
            take(points, attributes, layout, std::span(&property.attribute, 1));
        const bool compressed =
            attribute.type != ScalarType::kFloat64 &&
            stored_type(attribute.type, TileCoding::kCurve, values) == attribute.type;
        std::size_t offset = 0;
        if (compressed) {
            parts.properties.emplace_back(property.name, parts.compressed.size());
            parts.compressed.push_back(
                {Kind::kGeneric, attribute.type, attribute.components, std::move(values)});
        } else {
            offset = parts.batch_bytes.size();
            parts.batch_bytes.insert(parts.batch_bytes.end(), values.begin(), values.end());
            pad(parts.batch_bytes, 0, '\0');
        }
        parts.batch[property.name] = {{"byteOffset", offset},
                                      {"componentType", component_type(attribute.type)},
                                      {"type", shape(attribute.components)}};
    }
}

Json ids_json(std::span<const std::pair<std::string, std::size_t>> names,
              const CompressedPoints& compressed) {
    Json json = Json::object();
    for (const auto& [name, place] : names) {
        json[name] = compressed.ids[place];
    }
    return json;
}

}  // namespace

std::vector<std::byte> encode_pnts(const PntsPoints& points, std::span<const Attribute> attributes,
                                   const PropertyPlan& plan, bool narrow_colors) {
    const RowLayout layout = row_layout(attributes);
    Parts parts;
    add_features(parts, points, attributes, layout, plan, narrow_colors);
    add_properties(parts, points, attributes, layout, plan);
    CompressedPoints compressed =
        compress_points(points.positions.size(), parts.compressed, points.steps);

    Json features{{"POINTS_LENGTH", points.positions.size()}};
    for (const auto& [name, place] : parts.features) {
        features[name] = {{"byteOffset", 0}};
    }
    features["extensions"][kDraco] = {{"properties", ids_json(parts.features, compressed)},
                                      {"byteOffset", 0},
                                      {"byteLength", compressed.bytes.size()}};
    if (!parts.properties.empty()) {
        parts.batch["extensions"][kDraco] = {
            {"properties", ids_json(parts.properties, compressed)}};
    }
    const std::vector<std::byte> feature_json = json_bytes(features, kHeader);
    pad(compressed.bytes, 0, '\0');
    const std::vector<std::byte> batch_json =
        parts.batch.empty() ? std::vector<std::byte>() : json_bytes(parts.batch, 0);

    std::vector<std::byte> file;
    const std::array<const std::vector<std::byte>*, 4> sections{&feature_json, &compressed.bytes,
                                                                &batch_json, &parts.batch_bytes};
    std::size_t size = kHeader;
    for (const auto* section : sections) {
        size += section->size();
    }
    file.reserve(size);
    put(file, kMagic);
    put(file, kVersion);
    put(file, static_cast<std::uint32_t>(size));
    for (const auto* section : sections) {
        put(file, static_cast<std::uint32_t>(section->size()));
    }
    for (const auto* section : sections) {
        file.insert(file.end(), section->begin(), section->end());
    }
    return file;
}

}  // namespace knap
