#include "emit/value_limits.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "base/scalar.hpp"

namespace knap {

namespace {

using Bits = std::vector<std::uint64_t>;

/// The type whose bits stand for values of T.
template <typename T>
using Wide =
    std::conditional_t<std::is_floating_point_v<T>, double,
                       std::conditional_t<std::is_signed_v<T>, std::int64_t, std::uint64_t>>;

/// The same values as bits of another type, which holds them.
Bits converted(const Bits& values, ScalarType from, ScalarType to) {
    Bits result;
    result.reserve(values.size());
    for (const std::uint64_t bits : values) {
        visit_scalar(from, [&](auto have) {
            visit_scalar(to, [&](auto want) {
                using From = Wide<typename decltype(have)::Type>;
                using To = Wide<typename decltype(want)::Type>;
                if constexpr (std::is_same_v<From, To>) {
                    result.push_back(bits);
                } else {
                    result.push_back(
                        std::bit_cast<std::uint64_t>(static_cast<To>(std::bit_cast<From>(bits))));
                }
            });
        });
    }
    return result;
}

/// Of two lists of values of a type the lesser or the greater ones; none if one is not said.
Bits outer(const Bits& a, const Bits& b, ScalarType type, bool greater) {
    if (a.size() != b.size()) {
        return {};
    }
    Bits result(a.size());
    visit_scalar(type, [&](auto tag) {
        using Value = Wide<typename decltype(tag)::Type>;
        std::transform(a.begin(), a.end(), b.begin(), result.begin(),
                       [&](std::uint64_t x, std::uint64_t y) {
                           const bool first = std::bit_cast<Value>(x) < std::bit_cast<Value>(y);
                           return first == greater ? y : x;
                       });
    });
    return result;
}

ValueLimits limits_as(const Attribute& attribute, ScalarType type) {
    const ValueLimits& limits = attribute.limits;
    return {converted(limits.missing, attribute.type, type),
            converted(limits.least, attribute.type, type),
            converted(limits.greatest, attribute.type, type)};
}

}  // namespace

ValueLimits common_limits(const Attribute& a, const Attribute& b, ScalarType type) {
    const ValueLimits first = limits_as(a, type);
    const ValueLimits second = limits_as(b, type);
    return {first.missing == second.missing ? first.missing : Bits(),
            outer(first.least, second.least, type, false),
            outer(first.greatest, second.greatest, type, true)};
}

}  // namespace knap
