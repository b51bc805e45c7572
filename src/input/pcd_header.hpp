#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "knap/source.hpp"

namespace knap {

enum class PcdEncoding { kAscii, kBinary, kCompressed };

/// One field of a point.
struct PcdField {
    std::string name;
    ScalarType type = ScalarType::kFloat32;
    std::uint32_t count = 1;  ///< values a point, >= 1
    std::size_t offset = 0;   ///< of its first byte in a point of a binary file

    std::size_t size() const { return size_of(type) * count; }
    /// Bytes that are there for their place only.
    bool is_padding() const { return name == "_"; }
};

struct PcdHeader {
    PcdEncoding encoding = PcdEncoding::kAscii;
    std::vector<PcdField> fields;
    std::size_t stride = 0;  ///< bytes of a point of a binary file
    std::uint64_t width = 0;
    std::uint64_t height = 1;  ///< above 1: points are rows of an image
    std::uint64_t points = 0;
    bool has_viewpoint = false;     ///< other than the origin
    std::uint64_t data_offset = 0;  ///< first byte after the header
    std::uint64_t data_line = 0;    ///< number of the line that begins there
};

/// Reads the header of a PCD file, versions 0.5 to 0.7.
/// @throws InputError naming the line, if it is malformed or its numbers disagree
PcdHeader read_pcd_header(const InputFile& file);

}  // namespace knap
