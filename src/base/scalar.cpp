#include "base/scalar.hpp"

namespace knap {

const char* to_string(ScalarType type) {
    switch (type) {
        case ScalarType::kInt8:
            return "int8";
        case ScalarType::kUint8:
            return "uint8";
        case ScalarType::kInt16:
            return "int16";
        case ScalarType::kUint16:
            return "uint16";
        case ScalarType::kInt32:
            return "int32";
        case ScalarType::kUint32:
            return "uint32";
        case ScalarType::kInt64:
            return "int64";
        case ScalarType::kUint64:
            return "uint64";
        case ScalarType::kFloat32:
            return "float32";
        case ScalarType::kFloat64:
            break;
    }
    return "float64";
}

std::size_t size_of(ScalarType type) {
    return visit_scalar(type, [](auto tag) { return sizeof(typename decltype(tag)::Type); });
}

}  // namespace knap
