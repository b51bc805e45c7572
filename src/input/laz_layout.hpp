#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/file.hpp"
#include "input/las_header.hpp"

namespace knap {

/// Points of a LAZ file that are decoded together, from its first to its last.
struct LazChunk {
    std::uint64_t first = 0;   ///< index of its first point
    std::uint64_t points = 0;  ///< >= 1
    std::uint64_t begin = 0;   ///< its bytes in the file: [begin, end)
    std::uint64_t end = 0;
};

/// How a LAZ file is compressed and where its chunks are.
struct LazLayout {
    static constexpr std::uint16_t kUnchunked = 1;  ///< one run of points, no chunk table
    static constexpr std::uint16_t kChunked = 2;    ///< point formats 0 to 5
    static constexpr std::uint16_t kLayered = 3;    ///< point formats 6 to 10: a layer a field

    std::uint16_t compressor = kChunked;
    std::vector<std::byte> record;     ///< content of the LASzip record
    std::size_t layers = 0;            ///< kLayered: layers in a chunk
    std::vector<LazChunk> chunks;      ///< in the order of points; together exactly the points
    std::uint64_t typical_points = 0;  ///< in a chunk; 0 if unchunked
};

/// Reads the LASzip record and the chunk table and holds them against the header and the file.
/// @throws InputError if they are missing, malformed, truncated, or of another number of points
LazLayout read_laz_layout(const InputFile& file, const LasHeader& header,
                          std::span<const LasRecord> records);

/// Checks what a chunk says of itself: that a layered chunk holds the points and bytes that the
/// layout says.
/// @throws InputError if it does not
void check_laz_chunk(const InputFile& file, const LasHeader& header, const LazLayout& layout,
                     const LazChunk& chunk);

}  // namespace knap
