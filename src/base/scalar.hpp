#pragma once

#include <cstdint>
#include <utility>

#include "knap/source.hpp"

namespace knap {

inline bool is_floating(ScalarType type) {
    return type == ScalarType::kFloat32 || type == ScalarType::kFloat64;
}

template <typename T>
struct ScalarTag {
    using Type = T;
};

/// Calls visitor(ScalarTag<T>{}) with the C++ type that `type` means.
template <typename Visitor>
decltype(auto) visit_scalar(ScalarType type, Visitor&& visitor) {
    switch (type) {
        case ScalarType::kInt8:
            return visitor(ScalarTag<std::int8_t>{});
        case ScalarType::kUint8:
            return visitor(ScalarTag<std::uint8_t>{});
        case ScalarType::kInt16:
            return visitor(ScalarTag<std::int16_t>{});
        case ScalarType::kUint16:
            return visitor(ScalarTag<std::uint16_t>{});
        case ScalarType::kInt32:
            return visitor(ScalarTag<std::int32_t>{});
        case ScalarType::kUint32:
            return visitor(ScalarTag<std::uint32_t>{});
        case ScalarType::kInt64:
            return visitor(ScalarTag<std::int64_t>{});
        case ScalarType::kUint64:
            return visitor(ScalarTag<std::uint64_t>{});
        case ScalarType::kFloat32:
            return visitor(ScalarTag<float>{});
        case ScalarType::kFloat64:
            break;
    }
    return visitor(ScalarTag<double>{});
}

}  // namespace knap
