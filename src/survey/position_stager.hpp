#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "knap/source.hpp"
#include "store/column_file.hpp"
#include "store/position_file.hpp"

namespace knap {

/// Writes the positions that one thread reads, and the columns beside them, some of a range of a
/// source to a file: files so small that those which are read back can go a few at a time.
class PositionStager {
  public:
    /// @param folder  exists
    /// @param points  of the archive, about
    PositionStager(std::filesystem::path folder, std::uint64_t points);

    /// @param range   which of all ranges the chunk is of; its chunks come in order
    /// @param source  which the range is of
    /// @param info    of it
    /// @param columns of the chunk, indices in its schema
    /// @throws StorageError
    void add(std::size_t range, std::size_t source, const SourceInfo& info,
             std::span<const std::size_t> columns, const Chunk& chunk);

    /// All that was written, whole.
    /// @throws StorageError
    std::vector<PositionFile> finish();

  private:
    void close();

    std::filesystem::path folder_;
    std::uint64_t points_a_file_;
    std::size_t range_ = 0;
    std::unique_ptr<PositionWriter> writer_;
    std::unique_ptr<ColumnWriter> columns_;
    std::vector<PositionFile> files_;
};

}  // namespace knap
