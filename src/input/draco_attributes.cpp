#include "input/draco_attributes.hpp"

#include <draco/attributes/point_attribute.h>
#include <draco/metadata/geometry_metadata.h>
#include <draco/point_cloud/point_cloud.h>
#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "base/scalar.hpp"
#include "input/columns.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr std::array kScalarTypes{ScalarType::kInt8,   ScalarType::kUint8,  ScalarType::kInt16,
                                  ScalarType::kUint16, ScalarType::kInt32,  ScalarType::kUint32,
                                  ScalarType::kInt64,  ScalarType::kUint64, ScalarType::kFloat32,
                                  ScalarType::kFloat64};

constexpr std::array<std::string_view, 4> kColor{"red", "green", "blue", "alpha"};
constexpr std::array<std::string_view, 3> kNormal{"nx", "ny", "nz"};
constexpr std::array<std::string_view, 2> kTexture{"s", "t"};

std::optional<ScalarType> scalar_type(draco::DataType type) {
    switch (type) {
        case draco::DT_INT8:
            return ScalarType::kInt8;
        case draco::DT_UINT8:
        case draco::DT_BOOL:
            return ScalarType::kUint8;
        case draco::DT_INT16:
            return ScalarType::kInt16;
        case draco::DT_UINT16:
            return ScalarType::kUint16;
        case draco::DT_INT32:
            return ScalarType::kInt32;
        case draco::DT_UINT32:
            return ScalarType::kUint32;
        case draco::DT_INT64:
            return ScalarType::kInt64;
        case draco::DT_UINT64:
            return ScalarType::kUint64;
        case draco::DT_FLOAT32:
            return ScalarType::kFloat32;
        case draco::DT_FLOAT64:
            return ScalarType::kFloat64;
        default:
            return std::nullopt;
    }
}

/// The names of an attribute's components, if they are columns of their own.
std::span<const std::string_view> component_names(const draco::PointAttribute& attribute) {
    const std::size_t components = attribute.num_components();
    switch (attribute.attribute_type()) {
        case draco::GeometryAttribute::COLOR:
            if (components == 3 || components == 4) {
                return std::span(kColor).first(components);
            }
            break;
        case draco::GeometryAttribute::NORMAL:
            if (components == kNormal.size()) {
                return kNormal;
            }
            break;
        case draco::GeometryAttribute::TEX_COORD:
            if (components == kTexture.size()) {
                return kTexture;
            }
            break;
        default:
            break;
    }
    return {};
}

const char* default_name(const draco::PointAttribute& attribute) {
    switch (attribute.attribute_type()) {
        case draco::GeometryAttribute::COLOR:
            return "color";
        case draco::GeometryAttribute::NORMAL:
            return "normal";
        case draco::GeometryAttribute::TEX_COORD:
            return "tex_coord";
        default:
            return "generic";
    }
}

/// The values of all points, one behind the other.
std::vector<std::byte> values_of(const draco::PointAttribute& attribute, std::uint32_t points,
                                 std::size_t size, const std::filesystem::path& file) {
    std::vector<std::byte> values(points * size);
    for (std::uint32_t i = 0; i < points; ++i) {
        const auto index = attribute.mapped_index(draco::PointIndex(i));
        const std::uint8_t* const value = attribute.GetAddress(index);
        if (index.value() >= attribute.size() || !attribute.IsAddressValid(value + size - 1)) {
            throw InputError(
                fmt::format("{}: expected a value of each attribute for point {}, found none",
                            file.string(), i));
        }
        std::memcpy(values.data() + i * size, value, size);
    }
    return values;
}

/// What metadata says of an attribute, over what Draco stores.
Attribute described(Attribute stored, const draco::AttributeMetadata* metadata,
                    const std::filesystem::path& file) {
    std::string type;
    if (metadata == nullptr ||
        !metadata->GetEntryString(draco_keys::kAttributeName, &stored.name)) {
        return stored;
    }
    metadata->GetEntryDouble(draco_keys::kAttributeScale, &stored.scale);
    metadata->GetEntryDouble(draco_keys::kAttributeOffset, &stored.offset);
    metadata->GetEntryString(draco_keys::kDescription, &stored.description);
    for (const auto& [key, list] : draco_keys::kLimits) {
        std::vector<std::int32_t> halves;
        if (metadata->GetEntryIntArray(key, &halves)) {
            (stored.limits.*list).resize(halves.size() / 2);
            std::memcpy((stored.limits.*list).data(), halves.data(),
                        (stored.limits.*list).size() * sizeof(std::uint64_t));
        }
    }
    if (!metadata->GetEntryString(draco_keys::kAttributeType, &type)) {
        return stored;
    }
    const std::size_t size = stored.value_size();
    for (const ScalarType known : kScalarTypes) {
        if (type != to_string(known)) {
            continue;
        }
        const bool in_parts = stored.type == ScalarType::kUint16 && size % size_of(known) == 0;
        if (known == stored.type || (in_parts && size_of(known) > size_of(stored.type))) {
            stored.type = known;
            stored.components = static_cast<int>(size / size_of(known));
            return stored;
        }
    }
    throw InputError(fmt::format("{}: attribute \"{}\": expected {} values of {}, found type {}",
                                 file.string(), stored.name, stored.components,
                                 to_string(stored.type), type));
}

/// One component of each point.
std::vector<std::byte> component(std::span<const std::byte> values, std::size_t which,
                                 std::size_t size, std::size_t stride) {
    std::vector<std::byte> result(values.size() / stride * size);
    for (std::size_t i = 0; i * size < result.size(); ++i) {
        std::memcpy(result.data() + i * size, values.data() + i * stride + which * size, size);
    }
    return result;
}

}  // namespace

DracoColumns draco_columns(const draco::PointCloud& cloud, const std::filesystem::path& file) {
    DracoColumns columns;
    bool seen_positions = false;
    for (std::int32_t id = 0; id < cloud.num_attributes(); ++id) {
        const draco::PointAttribute& attribute = *cloud.attribute(id);
        const bool is_position =
            attribute.attribute_type() == draco::GeometryAttribute::POSITION && !seen_positions;
        const std::optional<ScalarType> type = scalar_type(attribute.data_type());
        seen_positions = seen_positions || is_position;
        if (is_position || !type || attribute.num_components() == 0) {
            continue;
        }
        const Attribute stored{default_name(attribute), *type, attribute.num_components()};
        const std::size_t stride = stored.value_size();
        std::vector<std::byte> values = values_of(attribute, cloud.num_points(), stride, file);
        const std::span<const std::string_view> names = component_names(attribute);
        for (std::size_t i = 0; i < names.size(); ++i) {
            columns.attributes.push_back({std::string(names[i]), *type, 1});
            columns.values.push_back(component(values, i, size_of(*type), stride));
        }
        if (names.empty()) {
            columns.attributes.push_back(
                described(stored, cloud.GetAttributeMetadataByAttributeId(id), file));
            columns.values.push_back(std::move(values));
        }
    }
    make_names_unique(columns.attributes);
    return columns;
}

}  // namespace knap
