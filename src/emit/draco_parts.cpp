#include "emit/draco_parts.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <string>

namespace knap {

namespace {

/// A float without loss and without a decimal point, which some locales write as a comma.
std::string exact_text(float value) {
    int exponent = 0;
    const float mantissa = std::frexp(value, &exponent);
    return fmt::format("0x{:x}p{}", static_cast<std::uint32_t>(std::ldexp(mantissa, 24)),
                       exponent - 24);
}

}  // namespace

// Set by name, because Draco's own setter passes the range through text of six decimals.
draco::Options quantisation(int bits, double step) {
    const double range = step * static_cast<double>((std::int64_t{1} << bits) - 1);
    draco::Options options;
    options.SetInt("quantization_bits", bits);
    options.SetString("quantization_origin", "0 0 0");
    options.SetString("quantization_range", exact_text(static_cast<float>(range)));
    return options;
}

int add_attribute(draco::PointCloud& cloud, draco::GeometryAttribute::Type kind,
                  draco::DataType type, std::size_t components, bool normalized,
                  std::span<const std::byte> values) {
    const auto count = static_cast<std::uint8_t>(components);
    const auto stride = static_cast<std::int64_t>(draco::DataTypeLength(type)) * count;
    draco::GeometryAttribute attribute;
    attribute.Init(kind, nullptr, count, type, normalized, stride, 0);
    const int id = cloud.AddAttribute(attribute, true, cloud.num_points());
    if (!values.empty()) {  // without any there is no buffer
        cloud.attribute(id)->buffer()->Write(0, values.data(), values.size());
    }
    return id;
}

draco::DataType draco_type(ScalarType type) {
    switch (type) {
        case ScalarType::kInt8:
            return draco::DT_INT8;
        case ScalarType::kUint8:
            return draco::DT_UINT8;
        case ScalarType::kInt16:
            return draco::DT_INT16;
        case ScalarType::kUint16:
            return draco::DT_UINT16;
        case ScalarType::kInt32:
            return draco::DT_INT32;
        case ScalarType::kUint32:
            return draco::DT_UINT32;
        case ScalarType::kFloat32:
            return draco::DT_FLOAT32;
        default:
            return draco::DT_INVALID;  // stored_type() gives no other
    }
}

}  // namespace knap
