#include "input/staged_reader.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/threads.hpp"
#include "input/columns.hpp"
#include "knap/error.hpp"
#include "store/column_file.hpp"

namespace knap {

namespace {

/// The points of a chunk in [first, last), indices in it.
Chunk part_of(const Chunk& chunk, const SourceInfo& info, std::span<const std::size_t> columns,
              std::uint64_t first, std::uint64_t last) {
    const auto cut = [&](const auto& values, std::size_t size) {
        return std::remove_cvref_t<decltype(values)>(
            values.begin() + static_cast<std::ptrdiff_t>(first * size),
            values.begin() + static_cast<std::ptrdiff_t>(last * size));
    };
    Chunk part{chunk.first + first, cut(chunk.positions, 1), {}};
    part.columns.reserve(columns.size());
    for (std::size_t i = 0; i < columns.size(); ++i) {
        part.columns.push_back(cut(chunk.columns[i], info.schema[columns[i]].value_size()));
    }
    return part;
}

/// The next points of a staged file, told apart from what their consumer throws.
class StagedBlocks {
  public:
    /// @param staged  columns of the file
    /// @param wanted  indices in `staged`
    StagedBlocks(const SourceInfo& info, const PositionFile& file,
                 std::span<const std::size_t> staged, std::vector<std::size_t> wanted)
        : left_(file.count), path_(file.path.string()), wanted_(std::move(wanted)) {
        guard([&] {
            positions_.emplace(file.path, PositionCodec(info.coordinates));
            if (!wanted_.empty()) {
                columns_.emplace(file.columns_path(), value_sizes(info, staged));
            }
        });
    }

    /// False at the end, or where a file is damaged.
    bool next(Chunk& chunk) {
        bool more = false;
        if (damage_.empty()) {
            guard([&] {
                more = positions_->next(chunk.positions) && chunk.positions.size() <= left_;
                if (more && columns_ &&
                    columns_->next(wanted_, chunk.columns) != chunk.positions.size()) {
                    throw StorageError(path_ +
                                       ": scratch file is damaged: the file of columns beside it "
                                       "has other blocks");
                }
            });
        }
        more = more && damage_.empty();
        left_ -= more ? chunk.positions.size() : 0;
        return more;
    }

    std::uint64_t left() const { return left_; }
    std::string damage() const {
        return damage_.empty() ? path_ + ": scratch file is damaged: points are missing" : damage_;
    }

  private:
    template <typename Read>
    void guard(const Read& read) {
        try {
            read();
        } catch (const StorageError& error) {
            damage_ = error.what();
        }
    }

    std::uint64_t left_;
    std::string path_;
    std::vector<std::size_t> wanted_;
    std::optional<PositionReader> positions_;
    std::optional<ColumnReader> columns_;
    std::string damage_;
};

}  // namespace

StagedReader::StagedReader(const SourceTable& table, const StagedPoints* staged,
                           std::vector<std::vector<std::size_t>> columns, Note note)
    : table_(table),
      staged_(staged),
      columns_(std::move(columns)),
      note_(std::move(note)),
      infos_(table.infos()) {}

std::vector<std::size_t> StagedReader::columns_of(std::size_t source) const {
    return columns_.empty() ? std::vector<std::size_t>() : columns_[source];
}

std::vector<ArchivePart> StagedReader::parts(std::uint64_t points) const {
    const std::span<const PositionFile> files =
        staged_ == nullptr ? std::span<const PositionFile>() : std::span(staged_->files);
    std::vector<ArchivePart> parts;
    std::size_t next = 0;
    for (const SourceRange& range : cut_into_ranges(infos_, points)) {
        if (next < files.size() && files[next].source == range.source) {
            for (; next < files.size() && files[next].source == range.source; ++next) {
                const PositionFile& file = files[next];
                parts.push_back({{file.source, file.first, file.count}, &file});
            }
        } else if (parts.empty() || parts.back().range.source != range.source ||
                   parts.back().staged == nullptr) {
            parts.push_back({range, nullptr});
        }
    }
    return parts;
}

void StagedReader::stream(std::span<const ArchivePart> parts, int workers, std::size_t chunk_points,
                          const ConsumeChunk& consume) const {
    std::vector<std::size_t> staged;
    std::vector<std::size_t> others;
    std::vector<SourceRange> ranges;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        if (parts[i].staged != nullptr) {
            staged.push_back(i);
        } else {
            others.push_back(i);
            ranges.push_back(parts[i].range);
        }
    }
    stream_ranges(
        infos_, ranges, workers, chunk_points,
        [&](std::size_t worker, std::size_t range, const Chunk& chunk) {
            consume(worker, others[range], chunk);
        },
        columns_);
    run_tasks(staged.size(), workers, [&](std::size_t i, std::size_t worker) {
        stream_staged(parts[staged[i]], chunk_points,
                      [&](const Chunk& chunk) { consume(worker, staged[i], chunk); });
    });
}

void StagedReader::stream_staged(const ArchivePart& part, std::size_t chunk_points,
                                 const Consume& consume) const {
    const std::size_t source = part.range.source;
    const std::vector<std::size_t> there =
        staged_->columns.empty() ? std::vector<std::size_t>() : staged_->columns[source];
    std::vector<std::size_t> wanted;
    for (const std::size_t column : columns_of(source)) {
        const auto found = std::find(there.begin(), there.end(), column);
        if (found == there.end()) {
            stream_source(part.range, chunk_points, consume);
            return;
        }
        wanted.push_back(static_cast<std::size_t>(found - there.begin()));
    }
    StagedBlocks blocks(infos_[source], *part.staged, there, std::move(wanted));
    Chunk chunk;
    chunk.first = part.range.first;
    while (blocks.next(chunk)) {
        consume(chunk);
        chunk.first += chunk.positions.size();
    }
    if (blocks.left() > 0) {
        note_(blocks.damage() + "; the points are read from the source again");
        stream_source({source, chunk.first, blocks.left()}, chunk_points, consume);
    }
}

// The points of a range of a source, which need not be able to seek.
void StagedReader::stream_source(const SourceRange& range, std::size_t chunk_points,
                                 const Consume& consume) const {
    const SourceInfo& info = infos_[range.source];
    const bool seeks = info.seek_granularity != 0;
    const SourceRange read =
        seeks ? range
              : SourceRange{range.source, 0, info.declared_count.value_or(SourceRange::kToTheEnd)};
    const std::vector<std::size_t> columns = columns_of(range.source);
    stream_ranges(
        infos_, std::span(&read, 1), 1, chunk_points,
        [&](std::size_t, std::size_t, const Chunk& chunk) {
            const std::uint64_t end = chunk.first + chunk.positions.size();
            const std::uint64_t first = std::max(chunk.first, range.first);
            const std::uint64_t last = std::min(end, range.first + range.count);
            if (first == chunk.first && last == end) {
                consume(chunk);
            } else if (first < last) {
                consume(part_of(chunk, info, columns, first - chunk.first, last - chunk.first));
            }
        },
        columns_);
}

std::uint64_t points_of(const SourceTable& table, std::span<const ArchivePart> parts) {
    std::uint64_t points = 0;
    for (const auto& [range, staged] : parts) {
        const SourceEntry& source = table.sources()[range.source];
        points += std::min(range.count, source.points - std::min(range.first, source.points));
    }
    return points;
}

}  // namespace knap
