#include "scatter/archive_parts.hpp"

#include <algorithm>
#include <optional>

#include "knap/error.hpp"

namespace knap {

namespace {

constexpr std::size_t kChunkPoints = std::size_t{1} << 16;
constexpr std::uint64_t kRangePoints = std::uint64_t{1} << 20;

/// The points of a range of a source, which need not be able to seek.
void stream_source(const SourceTable& table, const SourceRange& range,
                   const std::function<void(const Chunk&)>& consume) {
    const std::vector<SourceInfo> infos = table.infos();
    const SourceInfo& info = infos[range.source];
    const bool seeks = info.seek_granularity != 0;
    const SourceRange read =
        seeks ? range
              : SourceRange{range.source, 0, info.declared_count.value_or(SourceRange::kToTheEnd)};
    stream_ranges(infos, std::span(&read, 1), 1, kChunkPoints,
                  [&](std::size_t, std::size_t, const Chunk& chunk) {
                      const std::uint64_t end = chunk.first + chunk.positions.size();
                      const std::uint64_t first = std::max(chunk.first, range.first);
                      const std::uint64_t last = range.count == SourceRange::kToTheEnd
                                                     ? end
                                                     : std::min(end, range.first + range.count);
                      if (first == chunk.first && last == end) {
                          consume(chunk);
                      } else if (first < last) {
                          const auto begin = chunk.positions.begin();
                          consume({first,
                                   {begin + static_cast<std::ptrdiff_t>(first - chunk.first),
                                    begin + static_cast<std::ptrdiff_t>(last - chunk.first)},
                                   {}});
                      }
                  });
}

/// The next points of a position file, told apart from what their consumer throws.
class StagedPositions {
  public:
    StagedPositions(const SourceTable& table, const PositionFile& file) : left_(file.count) {
        guard([&] {
            reader_.emplace(file.path,
                            PositionCodec(table.sources()[file.source].info.coordinates));
        });
    }

    /// False at the end, or where the file is damaged.
    bool next(std::vector<Vec3>& positions) {
        bool more = false;
        if (reader_) {
            guard([&] { more = reader_->next(positions) && positions.size() <= left_; });
        }
        left_ -= more ? positions.size() : 0;
        return more;
    }

    std::uint64_t left() const { return left_; }
    const std::string& damage() const { return damage_; }

  private:
    template <typename Read>
    void guard(const Read& read) {
        try {
            read();
        } catch (const StorageError& error) {
            damage_ = error.what();
        }
    }

    std::optional<PositionReader> reader_;
    std::uint64_t left_;
    std::string damage_;
};

}  // namespace

std::vector<ArchivePart> cut_into_parts(const SourceTable& table,
                                        std::span<const PositionFile> positions) {
    std::vector<ArchivePart> parts;
    std::size_t next = 0;
    for (const SourceRange& range : cut_into_ranges(table.infos(), kRangePoints)) {
        if (next < positions.size() && positions[next].source == range.source) {
            for (; next < positions.size() && positions[next].source == range.source; ++next) {
                const PositionFile& file = positions[next];
                parts.push_back({{file.source, file.first, file.count}, &file});
            }
        } else if (parts.empty() || parts.back().range.source != range.source ||
                   parts.back().positions == nullptr) {
            parts.push_back({range, nullptr});
        }
    }
    return parts;
}

std::uint64_t points_of(const SourceTable& table, std::span<const ArchivePart> parts) {
    std::uint64_t points = 0;
    for (const auto& [range, positions] : parts) {
        const SourceEntry& source = table.sources()[range.source];
        points += std::min(range.count, source.points - std::min(range.first, source.points));
    }
    return points;
}

void stream_part(const SourceTable& table, const ArchivePart& part,
                 const std::function<void(const std::string&)>& note,
                 const std::function<void(const Chunk&)>& consume) {
    if (part.positions == nullptr) {
        stream_source(table, part.range, consume);
        return;
    }
    StagedPositions positions(table, *part.positions);
    Chunk chunk;
    chunk.first = part.range.first;
    while (positions.next(chunk.positions)) {
        consume(chunk);
        chunk.first += chunk.positions.size();
    }
    if (positions.left() > 0) {
        note((positions.damage().empty()
                  ? part.positions->path.string() + ": scratch file is damaged: points are missing"
                  : positions.damage()) +
             "; the points are read from the source again");
        stream_source(table, {part.range.source, chunk.first, positions.left()}, consume);
    }
}

}  // namespace knap
