#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "emit/lattice.hpp"
#include "knap/params.hpp"
#include "knap/source.hpp"

namespace knap {

/// How a tile is coded.
enum class TileCoding {
    kKdTree,      ///< Draco's kd-tree: whole numbers only, points in an order of its own
    kCurve,       ///< sequential, points along a Morton curve
    kSourceOrder  ///< sequential, points in the order of the sources
};

/// The ways to code tiles that an encoding may stand for, the likeliest first. Points that carry
/// nothing are smallest in a kd-tree.
std::vector<TileCoding> codings(TileEncoding encoding, std::span<const Attribute> attributes);

/// One attribute of a Draco tile: one attribute of the output, or the three of a colour or normal.
struct TileAttribute {
    enum class Kind { kGeneric, kColor, kNormal };

    Kind kind = Kind::kGeneric;
    std::vector<std::size_t> members;      ///< indices in the output's attributes
    ScalarType type = ScalarType::kUint8;  ///< of the values as the output has them
    int components = 1;                    ///< values a point

    std::size_t value_size() const { return size_of(type) * static_cast<std::size_t>(components); }
};

/// The attributes of a tile: red, green and blue of one type of 8 or 16 bits are a colour; nx, ny
/// and nz that are floats are a normal, except in a kd-tree, which cannot hold floats as they are;
/// all others stand alone.
std::vector<TileAttribute> tile_attributes(std::span<const Attribute> attributes,
                                           TileCoding coding);

/// The type in which Draco stores values: the type itself if Draco codes it without loss, else
/// uint16, and the bytes of a value are two or four of those.
///
/// @param values  of the type, one behind the other
ScalarType stored_type(ScalarType type, TileCoding coding, std::span<const std::byte> values);

/// @throws ConfigError if an attribute has more components than Draco holds
void check_tile_attributes(std::span<const Attribute> attributes);

/// The order in which a tile is coded: first comes point order[0].
/// @param points  in the order of the sources, from `origin` on, sides below 2^kTileBits steps
std::vector<std::size_t> coding_order(std::span<const LatticeIndex> points,
                                      const LatticeIndex& origin, TileCoding coding);

}  // namespace knap
