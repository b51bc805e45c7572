#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "knap/geometry.hpp"

namespace knap {

/// Writes a binary little-endian PLY of positions, streamed: memory does not grow with the points.
/// The file appears under its name on finish() or not at all.
class PlyWriter {
  public:
    enum class Precision { kFloat, kDouble };

    /// @param points    how many will be appended
    /// @param comments  one header line each
    /// @throws StorageError if the file cannot be created
    PlyWriter(const std::filesystem::path& path, std::uint64_t points, Precision precision,
              const std::vector<std::string>& comments);

    /// @throws StorageError if the disk is full or fails
    void append(std::span<const Vec3> positions);

    /// Size of the file with what was appended so far, bytes.
    std::uint64_t size() const { return file_.size() + buffer_.size(); }

    /// @return size of the file, bytes
    /// @throws StorageError if fewer or more points were appended than announced, or the disk fails
    std::uint64_t finish();

  private:
    void flush();

    std::filesystem::path path_;
    AtomicFile file_;
    Precision precision_;
    std::uint64_t announced_;
    std::uint64_t appended_ = 0;
    std::vector<std::byte> buffer_;
};

}  // namespace knap
