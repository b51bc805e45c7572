#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "knap/geometry.hpp"
#include "store/item_file.hpp"
#include "store/position_codec.hpp"

/// The positions of consecutive points of one source, in the form that it uses: where reading the
/// source again would cost more than reading them. A file of items (store/item_file.hpp) with the
/// magic "KNAPPOS1", an item a packed position.
namespace knap {

struct PositionFile {
    std::filesystem::path path;
    std::size_t source = 0;   ///< which the points are of
    std::uint64_t first = 0;  ///< index in the source of the first point
    std::uint64_t count = 0;  ///< points, those that are not finite included
    std::uint64_t bytes = 0;  ///< of the file
    /// Of the file of columns beside it (store/column_file.hpp), block by block as many points as
    /// this one; 0: there is none.
    std::uint64_t column_bytes = 0;

    std::filesystem::path columns_path() const {
        return std::filesystem::path(path).replace_extension(".columns");
    }
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
    std::uint64_t finish() { return file_.finish(); }

  private:
    ItemWriter file_;
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
    ItemReader file_;
    PositionCodec codec_;
};

}  // namespace knap
