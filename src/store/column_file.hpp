#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "base/file.hpp"

/// What consecutive points of one source carry beside their positions, packed: where reading the
/// source again would cost more.
///
///     file    header block*
///     header  "KNAPCOLS" version:u32 = 1 columns:u32, then for each column its value_size:u32
///     block   count:u32 payload_size:u32 checksum:u64 payload
///     payload for each column a Blosc buffer of count values
///
/// The last block is empty (count 0): a file without it is torn. The checksum is XXH3-64 of the
/// payload, xor splitmix64(count). Prose: docs/formats.md.
namespace knap {

/// Writes a column file; it exists only once finish() has returned.
class ColumnWriter {
  public:
    /// @param value_sizes  bytes of a value of each column, > 0; at least one column
    /// @throws StorageError
    ColumnWriter(const std::filesystem::path& path, std::vector<std::size_t> value_sizes);

    /// A block: some points of a chunk.
    /// @param columns  of the chunk, as Chunk has them
    /// @param first    index of the first point
    /// @param count    > 0, so few that no column has 2 GiB
    /// @throws StorageError if the disk is full or fails
    void add(std::span<const std::vector<std::byte>> columns, std::size_t first, std::size_t count);

    /// @return size of the file
    /// @throws StorageError
    std::uint64_t finish();

  private:
    void write_block(std::uint32_t count);

    AtomicFile file_;
    std::vector<std::size_t> value_sizes_;
    std::vector<std::byte> payload_;
};

/// Reads a column file block by block. Holds one block.
class ColumnReader {
  public:
    /// @param value_sizes  as they were given to the writer
    /// @throws StorageError if the file is missing or of another form, naming it
    ColumnReader(const std::filesystem::path& path, std::vector<std::size_t> value_sizes);

    /// Unpacks some columns of the next block.
    /// @param wanted   indices of columns
    /// @param columns  replaced: one for each of `wanted`
    /// @return         points of the block; 0 at the end
    /// @throws StorageError if the file is torn or fails a checksum, naming it and the byte
    std::size_t next(std::span<const std::size_t> wanted,
                     std::vector<std::vector<std::byte>>& columns);

  private:
    [[noreturn]] void throw_damaged(const char* what) const;

    InputFile file_;
    std::vector<std::size_t> value_sizes_;
    std::uint64_t at_ = 0;
    std::vector<std::byte> payload_;
};

}  // namespace knap
