#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "base/file.hpp"
#include "knap/geometry.hpp"
#include "store/position_codec.hpp"

/// The positions of consecutive points of one source, in the form that it uses: where reading the
/// source again would cost more than reading them.
///
///     file    header block*
///     header  "KNAPPOS1" version:u32 packed_size:u32
///     block   count:u32 reserved:u32 checksum:u64 payload
///     payload count packed positions
///
/// The last block is empty (count 0): a file without it is torn. The checksum is XXH3-64 of the
/// payload, xor splitmix64(count). Prose: docs/formats.md.
namespace knap {

struct PositionFile {
    std::filesystem::path path;
    std::size_t source = 0;   ///< which the points are of
    std::uint64_t first = 0;  ///< index in the source of the first point
    std::uint64_t count = 0;  ///< points, those that are not finite included
    std::uint64_t bytes = 0;  ///< of the file
};

/// Writes a position file; it exists only once finish() has returned.
class PositionWriter {
  public:
    /// @throws StorageError
    PositionWriter(const std::filesystem::path& path, const PositionCodec& codec);

    /// The next points, fewer than 2^32 / 24: a block.
    /// @throws StorageError if the disk is full or fails
    void add(std::span<const Vec3> positions);

    /// @return size of the file
    /// @throws StorageError
    std::uint64_t finish();

  private:
    void write_block(std::span<const Vec3> positions);

    AtomicFile file_;
    PositionCodec codec_;
    std::vector<std::byte> block_;
};

/// Reads a position file block by block.
class PositionReader {
  public:
    /// @throws StorageError if the file is missing or of another form, naming it
    PositionReader(const std::filesystem::path& path, const PositionCodec& codec);

    /// Replaces `positions` by the next block, as it was added; false, with none, at the end.
    /// @throws StorageError if the file is torn or fails a checksum, naming it and the byte
    bool next(std::vector<Vec3>& positions);

  private:
    [[noreturn]] void throw_damaged(const char* what) const;

    InputFile file_;
    PositionCodec codec_;
    std::uint64_t at_ = 0;
    std::vector<std::byte> payload_;
};

}  // namespace knap
