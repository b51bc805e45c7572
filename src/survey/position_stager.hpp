#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "knap/source.hpp"
#include "store/position_file.hpp"

namespace knap {

/// Writes the positions that one thread reads, some of a range of a source to a file: files so
/// small that those which are read back can go a few at a time.
class PositionStager {
  public:
    /// @param folder  exists
    /// @param points  of the archive, about
    PositionStager(std::filesystem::path folder, std::uint64_t points);

    /// @param range   which of all ranges the chunk is of; its chunks come in order
    /// @param source  which the range is of, and how it stores coordinates
    /// @throws StorageError
    void add(std::size_t range, std::size_t source, const CoordinateFormat& format,
             const Chunk& chunk);

    /// All that was written, whole.
    /// @throws StorageError
    std::vector<PositionFile> finish();

  private:
    void close();

    std::filesystem::path folder_;
    std::uint64_t points_a_file_;
    std::size_t range_ = 0;
    std::unique_ptr<PositionWriter> writer_;
    std::vector<PositionFile> files_;
};

}  // namespace knap
