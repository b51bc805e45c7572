#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace knap {

/// One entry of the chunk table of a LAZ file.
struct LazTableEntry {
    std::uint32_t points = 0;  ///< 0 where all chunks are of one size and the table has no counts
    std::uint32_t bytes = 0;
};

/// Decodes the entries of a chunk table, which are differences coded by LAZ's adaptive arithmetic
/// coder (LAZ specification, ASPRS 2013, sections on the chunk table and the integer compressor).
///
/// @param coded        the bytes behind the version and the number of chunks
/// @param chunks       entries in the table
/// @param with_counts  chunks are of variable size: an entry begins with its number of points
/// @return             fewer than `chunks` entries if the bytes end before
std::vector<LazTableEntry> decode_laz_chunk_table(std::span<const std::byte> coded,
                                                  std::uint32_t chunks, bool with_counts);

}  // namespace knap
