#include "input/stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "base/threads.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

/// What a worker keeps from one range to the next.
struct Reader {
    std::unique_ptr<PointSource> source;
    std::size_t index = 0;
    std::uint64_t next = 0;
    Chunk chunk;

    /// Brings the reader to `first` of source number `of`.
    void open(const SourceInfo& info, std::size_t of, std::uint64_t first,
              std::span<const std::size_t> columns) {
        if (!source || index != of || (next != first && info.seek_granularity == 0)) {
            source.reset();
            source = open_source(info.path);
            index = of;
            next = 0;
            if (source->info().size_bytes != info.size_bytes) {
                throw InputError(fmt::format(
                    "{}: expected {} bytes as when the job began, found {}: the file has changed",
                    info.path.string(), info.size_bytes, source->info().size_bytes));
            }
            if (!columns.empty()) {
                select(info, columns);
            }
        }
        if (next != first) {
            source->seek(first);
            next = first;
        }
    }

    void select(const SourceInfo& info, std::span<const std::size_t> columns) const {
        if (source->info().schema != info.schema) {
            throw InputError(fmt::format(
                "{}: expected attributes as when the job began, found others: the file has changed",
                info.path.string()));
        }
        source->select(columns);
    }
};

void read_range(Reader& reader, const SourceInfo& info, const SourceRange& range,
                std::size_t chunk_points, std::span<const std::size_t> columns,
                const std::function<void(const Chunk&)>& consume) {
    reader.open(info, range.source, range.first, columns);
    std::uint64_t left = range.count;
    while (left > 0) {
        const auto most = static_cast<std::size_t>(std::min<std::uint64_t>(chunk_points, left));
        if (!reader.source->read(reader.chunk, most)) {
            if (range.count == SourceRange::kToTheEnd) {
                return;
            }
            throw InputError(
                fmt::format("{}: the data ends early: expected {} points from point {}, found {}",
                            info.path.string(), range.count, range.first, range.count - left));
        }
        reader.next += reader.chunk.positions.size();
        left -= range.count == SourceRange::kToTheEnd ? 0 : reader.chunk.positions.size();
        consume(reader.chunk);
    }
    // The source checks what is behind its last point only when asked for one more.
    if (range.first + range.count == info.declared_count && reader.source->read(reader.chunk, 1)) {
        throw InputError(fmt::format("{}: expected {} points, found more", info.path.string(),
                                     *info.declared_count));
    }
}

}  // namespace

std::vector<SourceRange> cut_into_ranges(std::span<const SourceInfo> sources,
                                         std::uint64_t points) {
    std::vector<SourceRange> ranges;
    for (std::size_t i = 0; i < sources.size(); ++i) {
        const std::uint64_t count = sources[i].declared_count.value_or(SourceRange::kToTheEnd);
        const std::uint64_t unit = sources[i].seek_granularity;
        if (unit == 0 || count == SourceRange::kToTheEnd || count == 0) {
            ranges.push_back({i, 0, count});
            continue;
        }
        const std::uint64_t step = std::max<std::uint64_t>(1, (points + unit / 2) / unit) * unit;
        for (std::uint64_t first = 0; first < count; first += step) {
            ranges.push_back({i, first, std::min(step, count - first)});
        }
    }
    return ranges;
}

void stream_ranges(std::span<const SourceInfo> sources, std::span<const SourceRange> ranges,
                   int workers, std::size_t chunk_points, const ConsumeChunk& consume,
                   std::span<const std::vector<std::size_t>> columns) {
    std::vector<Reader> readers(static_cast<std::size_t>(std::max(workers, 1)));
    run_tasks(ranges.size(), workers, [&](std::size_t task, std::size_t worker) {
        const SourceRange& range = ranges[task];
        const std::span<const std::size_t> selected =
            columns.empty() ? std::span<const std::size_t>() : columns[range.source];
        read_range(readers[worker], sources[range.source], range, chunk_points, selected,
                   [&](const Chunk& chunk) { consume(worker, task, chunk); });
    });
}

}  // namespace knap
