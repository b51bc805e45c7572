#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "base/file.hpp"

/// Scratch files of items of one size, in blocks.
///
///     file    header block*
///     header  magic (8 bytes) version:u32 = 1 item_size:u32
///     block   count:u32 reserved:u32 checksum:u64 payload
///     payload count items
///
/// The last block is empty (count 0): a file without it is torn. The checksum is XXH3-64 of the
/// payload, xor splitmix64(count). Prose: docs/formats.md.
namespace knap {

/// What is in such a file.
struct ItemFormat {
    std::string_view magic;  ///< of 8 bytes
    std::string_view name;   ///< as errors call the file: "row file"
    std::size_t item_size;   ///< bytes, > 0
};

/// Writes a file of items; it exists only once finish() has returned.
class ItemWriter {
  public:
    /// @throws StorageError
    ItemWriter(const std::filesystem::path& path, const ItemFormat& format);

    /// A block.
    /// @param items  fewer than 2^32, at least one
    /// @throws StorageError if the disk is full or fails
    void add(std::span<const std::byte> items) { write_block(items); }

    /// @return size of the file
    /// @throws StorageError
    std::uint64_t finish();

  private:
    void write_block(std::span<const std::byte> items);

    AtomicFile file_;
    std::size_t item_size_;
};

/// Reads a file of items block by block. Holds one block.
class ItemReader {
  public:
    /// @throws StorageError if the file is missing or of another format, naming it
    ItemReader(const std::filesystem::path& path, const ItemFormat& format);

    /// The items of the next block, until the next call; none at the end.
    /// @throws StorageError if the file is torn or fails a checksum, naming it and the byte
    std::span<const std::byte> next();

    /// @throws StorageError naming the file and the byte that reading has got to
    [[noreturn]] void throw_damaged(std::string_view what) const;

  private:
    InputFile file_;
    std::size_t item_size_;
    std::uint64_t at_ = 0;
    std::vector<std::byte> items_;
};

}  // namespace knap
