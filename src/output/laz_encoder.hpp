#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "base/file.hpp"

namespace knap {

/// Compresses LAS records into the end of a file.
class LazEncoder {
  public:
    /// @param file           outlives the encoder
    /// @param path           for errors
    /// @param point_format   0 to 3, 6 to 8
    /// @param record_length  bytes of a record, extra bytes included
    /// @throws ConfigError if knap was built without LASzip
    LazEncoder(AtomicFile& file, const std::filesystem::path& path, int point_format,
               std::uint16_t record_length);
    ~LazEncoder();
    LazEncoder(const LazEncoder&) = delete;
    LazEncoder& operator=(const LazEncoder&) = delete;

    /// Content of the record that tells how the points are compressed.
    std::vector<std::byte> record() const;

    /// To be called when all that stands before the points is in the file.
    void begin();

    /// @param record  as it would be in a LAS file
    /// @throws StorageError if the disk is full or fails
    void append(std::span<const std::byte> record);

    /// Writes what is left, and the table of chunks.
    /// @throws StorageError
    void end();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace knap
