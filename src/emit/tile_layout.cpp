#include "emit/tile_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>

#include "base/scalar.hpp"
#include "emit/tiles.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

// Draco counts components with 8 bits, some of its parts with a sign.
constexpr std::size_t kMostComponents = 127;
// Draco takes differences of 32-bit numbers for numbers of 31 bits.
constexpr std::int64_t kWidest = std::int64_t{1} << 30;
// A sequential coder counts how often each number between the smallest and the largest occurs: that
// takes 4 bytes a number, of 2^31 of them 8 GiB.
constexpr std::int64_t kWidestSpan = std::int64_t{1} << 20;

using Names = std::array<std::string_view, 3>;
constexpr Names kColor{"red", "green", "blue"};
constexpr Names kNormal{"nx", "ny", "nz"};

/// The attributes of three names, if each is one plain value of the same type.
std::optional<std::vector<std::size_t>> triple(std::span<const Attribute> attributes,
                                               const Names& names) {
    std::vector<std::size_t> members;
    for (const std::string_view name : names) {
        const auto found =
            std::find_if(attributes.begin(), attributes.end(),
                         [&](const Attribute& attribute) { return attribute.name == name; });
        if (found == attributes.end()) {
            return std::nullopt;
        }
        const Attribute& first = members.empty() ? *found : attributes[members.front()];
        if (*found != Attribute{std::string(name), first.type}) {
            return std::nullopt;
        }
        members.push_back(static_cast<std::size_t>(found - attributes.begin()));
    }
    return members;
}

/// Spreads the lowest 20 bits so that two others fit between each two.
std::uint64_t spread(std::uint64_t bits) {
    bits = (bits | bits << 32) & 0x001f00000000ffffU;
    bits = (bits | bits << 16) & 0x001f0000ff0000ffU;
    bits = (bits | bits << 8) & 0x100f00f00f00f00fU;
    bits = (bits | bits << 4) & 0x10c30c30c30c30c3U;
    return (bits | bits << 2) & 0x1249249249249249U;
}

template <typename T>
bool is_narrow(TileCoding coding, std::span<const std::byte> values) {
    std::int64_t least = std::numeric_limits<std::int64_t>::max();
    std::int64_t largest = std::numeric_limits<std::int64_t>::min();
    for (std::size_t i = 0; i < values.size(); i += sizeof(T)) {
        T value{};
        std::memcpy(&value, values.data() + i, sizeof value);
        const auto wide = static_cast<std::int64_t>(value);
        least = std::min(least, wide);
        largest = std::max(largest, wide);
    }
    const bool fits = least >= -kWidest && largest < kWidest;
    return values.empty() ||
           (fits && (coding == TileCoding::kKdTree || largest - least < kWidestSpan));
}

}  // namespace

std::vector<TileCoding> codings(TileEncoding encoding, std::span<const Attribute> attributes) {
    switch (encoding) {
        case TileEncoding::kAuto:
            if (!attributes.empty()) {
                return {TileCoding::kCurve, TileCoding::kSourceOrder, TileCoding::kKdTree};
            }
            break;
        case TileEncoding::kSequential:
            return attributes.empty()
                       ? std::vector<TileCoding>{TileCoding::kCurve}
                       : std::vector<TileCoding>{TileCoding::kCurve, TileCoding::kSourceOrder};
        case TileEncoding::kKdTree:
            break;
    }
    return {TileCoding::kKdTree};
}

std::vector<TileAttribute> tile_attributes(std::span<const Attribute> attributes,
                                           TileCoding coding) {
    using Kind = TileAttribute::Kind;
    std::vector<TileAttribute> groups;
    const auto color = triple(attributes, kColor);
    if (color) {
        const ScalarType type = attributes[color->front()].type;
        if (type == ScalarType::kUint8 || type == ScalarType::kUint16) {
            groups.push_back({Kind::kColor, *color, type, 3});
        }
    }
    const auto normal = triple(attributes, kNormal);
    if (normal && coding != TileCoding::kKdTree &&
        attributes[normal->front()].type == ScalarType::kFloat32) {
        groups.push_back({Kind::kNormal, *normal, ScalarType::kFloat32, 3});
    }
    std::vector<bool> taken(attributes.size());
    for (const TileAttribute& group : groups) {
        for (const std::size_t member : group.members) {
            taken[member] = true;
        }
    }
    for (std::size_t i = 0; i < attributes.size(); ++i) {
        if (!taken[i]) {
            groups.push_back({Kind::kGeneric, {i}, attributes[i].type, attributes[i].components});
        }
    }
    return groups;
}

ScalarType stored_type(ScalarType type, TileCoding coding, std::span<const std::byte> values) {
    bool as_it_is = size_of(type) < 4;
    if (type == ScalarType::kFloat32) {
        as_it_is = coding != TileCoding::kKdTree;
    } else if (type == ScalarType::kInt32) {
        as_it_is = is_narrow<std::int32_t>(coding, values);
    } else if (type == ScalarType::kUint32) {
        as_it_is = is_narrow<std::uint32_t>(coding, values);
    }
    return as_it_is ? type : ScalarType::kUint16;
}

void check_tile_attributes(std::span<const Attribute> attributes) {
    for (const Attribute& attribute : attributes) {
        const std::size_t parts = std::max<std::size_t>(size_of(attribute.type) / 2, 1);
        const std::size_t most = kMostComponents / parts;
        if (static_cast<std::size_t>(attribute.components) > most) {
            throw ConfigError(fmt::format(
                "attribute \"{}\": expected at most {} values of {} a point in Draco, found {}; "
                "name those to be carried in output.attributes (--attributes), without it",
                attribute.name, most, to_string(attribute.type), attribute.components));
        }
    }
}

std::vector<std::size_t> coding_order(std::span<const LatticeIndex> points,
                                      const LatticeIndex& origin, TileCoding coding) {
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    if (coding == TileCoding::kKdTree) {
        std::stable_sort(order.begin(), order.end(),
                         [&](std::size_t a, std::size_t b) { return points[a] < points[b]; });
    } else if (coding == TileCoding::kCurve) {
        std::vector<std::pair<std::uint64_t, std::size_t>> keys(points.size());
        for (std::size_t i = 0; i < points.size(); ++i) {
            std::uint64_t key = 0;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                key |= spread(static_cast<std::uint64_t>(points[i][axis] - origin[axis])) << axis;
            }
            keys[i] = {key, i};
        }
        std::sort(keys.begin(), keys.end());
        std::transform(keys.begin(), keys.end(), order.begin(),
                       [](const auto& key) { return key.second; });
    }
    return order;
}

}  // namespace knap
