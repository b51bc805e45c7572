#include "input/coordinates.hpp"

#include <algorithm>

#include "base/scalar.hpp"
#include "input/bytes.hpp"

namespace knap {

namespace {

constexpr std::array<double Vec3::*, 3> kAxisMembers{&Vec3::x, &Vec3::y, &Vec3::z};

template <typename T, bool kSwap>
void decode(const std::byte* from, std::size_t stride, std::size_t n, Vec3* to,
            double Vec3::*axis) {
    for (std::size_t i = 0; i < n; ++i) {
        to[i].*axis = static_cast<double>(load<T, kSwap>(from + i * stride));
    }
}

bool is_small_integer(ScalarType type) {
    return !is_floating(type) && size_of(type) <= 2;
}

}  // namespace

CoordinateFormat format_of_coordinates(const std::array<ScalarType, 3>& types) {
    const auto all_are = [&](ScalarType wide) {
        return std::ranges::all_of(types,
                                   [&](ScalarType t) { return t == wide || is_small_integer(t); });
    };
    CoordinateFormat format;
    if (all_are(ScalarType::kFloat32)) {
        format.kind = CoordinateKind::kFloat32;
    } else if (all_are(ScalarType::kInt32)) {
        format.kind = CoordinateKind::kInt32;
    }
    return format;
}

void decode_coordinate(const std::byte* from, std::size_t stride, std::size_t n, Vec3* to, int axis,
                       ScalarType type, bool swap) {
    double Vec3::*const member = kAxisMembers[static_cast<std::size_t>(axis)];
    visit_scalar(type, [&](auto tag) {
        using T = typename decltype(tag)::Type;
        swap ? decode<T, true>(from, stride, n, to, member)
             : decode<T, false>(from, stride, n, to, member);
    });
}

}  // namespace knap
