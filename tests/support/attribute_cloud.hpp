#pragma once

#include <cstddef>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "knap/archive.hpp"
#include "knap/source.hpp"

/// Clouds whose points carry something, and what became of it.
namespace knap::test {

/// Points with a column of values for each attribute, as Chunk has them.
struct AttributeCloud {
    std::vector<Vec3> positions;
    std::vector<Attribute> attributes;
    std::vector<std::vector<std::byte>> columns;
};

/// Random bits for each value, or random whole numbers from 0 to 9 where `small`: any bits are a
/// value of any type.
std::vector<std::byte> random_column(std::mt19937_64& random, const Attribute& attribute,
                                     std::size_t points, bool small);

/// A sphere of `points` points with a colour, a normal, and an attribute of each type that a PLY
/// has.
AttributeCloud attribute_cloud(std::size_t points, std::uint64_t seed);

/// Writes a binary PLY; attributes of one component, of types that a PLY has.
/// @param as_float  positions as floats
void write_ply(const std::filesystem::path& path, const AttributeCloud& cloud, bool as_float);

/// One text a kept point, sorted: its position on the archive's lattice, and the archive's
/// attributes as the sources have them.
/// @param ids  of the kept points, in the stream of all files
std::vector<std::string> carried_by_sources(const std::vector<std::filesystem::path>& files,
                                            const std::vector<PointId>& ids,
                                            const Manifest& manifest);

/// The same by the archive's tiles.
std::vector<std::string> carried_by(const Archive& archive);

}  // namespace knap::test
