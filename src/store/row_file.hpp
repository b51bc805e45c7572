#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "base/file.hpp"

/// Rows of bytes, all of one size: what kept points carry, on their way into tiles.
///
///     file    header block*
///     header  "KNAPROWS" version:u32 row_size:u32
///     block   count:u32 reserved:u32 checksum:u64 payload
///     payload count rows
///
/// The last block is empty (count 0): a file without it is torn. The checksum is XXH3-64 of the
/// payload, xor splitmix64(count). Prose: docs/formats.md.
namespace knap {

/// Writes a row file; it exists only once finish() has returned.
class RowWriter {
  public:
    /// @param row_size  bytes, > 0
    /// @throws StorageError
    RowWriter(const std::filesystem::path& path, std::size_t row_size);

    /// @param row  of row_size bytes
    void add(std::span<const std::byte> row);

    /// @return size of the file
    /// @throws StorageError
    std::uint64_t finish();

  private:
    void write_block();

    AtomicFile file_;
    std::size_t row_size_;
    std::vector<std::byte> rows_;
};

/// Reads a row file row by row. Holds one block.
class RowReader {
  public:
    /// @throws StorageError if the file is missing or of another row size, naming it
    RowReader(const std::filesystem::path& path, std::size_t row_size);

    /// The next row, until the next call.
    /// @throws StorageError if there is none, or the file fails a checksum, naming it and the byte
    std::span<const std::byte> next();

  private:
    void read_block();
    [[noreturn]] void throw_damaged(const char* what) const;

    InputFile file_;
    std::size_t row_size_;
    std::uint64_t at_ = 0;
    std::vector<std::byte> rows_;
    std::size_t next_ = 0;  // bytes of rows_ that were given
};

}  // namespace knap
