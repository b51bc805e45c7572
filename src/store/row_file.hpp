#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "store/item_file.hpp"

/// Rows of bytes, all of one size: what kept points carry, on their way into tiles. A file of items
/// (store/item_file.hpp) with the magic "KNAPROWS", an item a row.
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
    ItemWriter file_;
    std::size_t block_size_;
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
    ItemReader file_;
    std::size_t row_size_;
    std::span<const std::byte> rows_;  // of its block, not given yet
};

}  // namespace knap
