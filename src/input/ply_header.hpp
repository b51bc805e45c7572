#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "knap/source.hpp"

namespace knap {

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };

struct PlyProperty {
    std::string name;
    ScalarType type = ScalarType::kFloat32;  ///< of a list: of its items
    std::optional<ScalarType> list_count;    ///< of a list: type of its length
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties;

    bool fixed_size() const;
    /// Bytes of one instance in a binary file; with lists, of one whose lists are empty.
    std::size_t stride() const;
};

struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::kAscii;
    std::vector<PlyElement> elements;
    std::size_t vertex = 0;             ///< index in `elements`
    std::array<std::size_t, 3> axes{};  ///< indices of x, y, z in the properties of the vertex
    std::uint64_t data_offset = 0;      ///< first byte after the header
    std::uint64_t data_line = 0;        ///< number of the line that begins there

    const PlyElement& vertices() const { return elements[vertex]; }
};

/// Reads the header of a PLY file: lines end in LF, CR or CR LF, blanks are free.
/// @throws InputError naming the line, if it is malformed or has no vertex element with x, y and z
PlyHeader read_ply_header(const InputFile& file);

}  // namespace knap
