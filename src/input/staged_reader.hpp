#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "input/stream.hpp"
#include "store/position_file.hpp"
#include "store/source_table.hpp"

namespace knap {

/// What the survey has left in scratch of sources whose points cost far more to read than to read
/// back.
struct StagedPoints {
    std::vector<PositionFile> files;  ///< in stream order; of a source all points or none
    /// Of each source: indices in its schema of the columns beside its positions. Empty: none of
    /// any.
    std::vector<std::vector<std::size_t>> columns;
    bool stays = false;  ///< to the end of the job; else until the points are scattered
};

/// Consecutive points of one source, and the file that holds their positions, if one does.
struct ArchivePart {
    SourceRange range;
    const PositionFile* staged = nullptr;
};

/// Reads the archive again after the survey: from scratch where it can, else from the sources.
/// What is damaged in scratch, the source stands in for.
class StagedReader {
  public:
    /// Told that a file in scratch is damaged, from any thread.
    using Note = std::function<void(const std::string&)>;

    /// @param table    must outlive the reader
    /// @param staged   as the survey left it; must outlive the reader; null: nothing
    /// @param columns  as stream_ranges() takes them
    StagedReader(const SourceTable& table, const StagedPoints* staged,
                 std::vector<std::vector<std::size_t>> columns, Note note);

    /// The archive in parts of about `points` points, or as they are staged, in stream order.
    std::vector<ArchivePart> parts(std::uint64_t points) const;

    /// Reads parts as stream_ranges() reads ranges. Parts are chunked as they were staged where
    /// that is finer.
    /// @throws InputError if a source that is read has changed since the survey
    void stream(std::span<const ArchivePart> parts, int workers, std::size_t chunk_points,
                const ConsumeChunk& consume) const;

  private:
    using Consume = std::function<void(const Chunk&)>;

    std::vector<std::size_t> columns_of(std::size_t source) const;
    void stream_staged(const ArchivePart& part, std::size_t chunk_points,
                       const Consume& consume) const;
    void stream_source(const SourceRange& range, std::size_t chunk_points,
                       const Consume& consume) const;

    const SourceTable& table_;
    const StagedPoints* staged_;
    std::vector<std::vector<std::size_t>> columns_;
    Note note_;
    std::vector<SourceInfo> infos_;
};

/// Points of the parts.
std::uint64_t points_of(const SourceTable& table, std::span<const ArchivePart> parts);

}  // namespace knap
