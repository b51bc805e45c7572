#include "emit/kept_sources.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <string_view>
#include <utility>
#include <vector>

#include "base/threads.hpp"
#include "input/staged_reader.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

// Long enough that opening a source costs little, short enough that a range without kept points
// can be skipped and threads end together.
constexpr std::uint64_t kRangePoints = 1 << 20;
// Shorter where order counts: what is read before its turn waits in memory.
constexpr std::uint64_t kOrderedRangePoints = 1 << 17;
constexpr std::size_t kWaitingBytes = std::size_t{8} << 20;
constexpr std::size_t kChunkPoints = 1 << 14;

/// Kept points that a thread has read.
struct Batch {
    std::uint64_t place = 0;
    std::vector<PointId> ids;
    std::vector<Vec3> positions;
    std::vector<std::byte> rows;

    KeptBlock block() const { return {place, ids, positions, rows}; }
    void clear() {
        ids.clear();
        positions.clear();
        rows.clear();
    }
};

/// Picks the kept points out of chunks.
class KeptReader {
  public:
    KeptReader(const KeptPoints& kept, const std::function<void(std::uint64_t)>& advance)
        : kept_(kept),
          advance_(advance),
          reader_(kept.sources, kept.staged, kept.attributes.selected(), kept.note) {}

    /// The parts that hold a kept point; the others are done with at once.
    std::vector<ArchivePart> parts_to_read(std::uint64_t points) {
        std::vector<ArchivePart> wanted;
        for (const ArchivePart& part : reader_.parts(points)) {
            const SourceRange& range = part.range;
            const SourceEntry& source = kept_.sources.sources()[range.source];
            const PointId first = source.first_id + std::min(range.first, source.points);
            const PointId end =
                first + std::min(range.count, source.first_id + source.points - first);
            if (kept_.selection.count_before(end) != kept_.selection.count_before(first)) {
                wanted.push_back(part);
            } else {
                report(end - first);
            }
        }
        return wanted;
    }

    void stream(std::span<const ArchivePart> parts, int workers, const ConsumeChunk& consume) {
        reader_.stream(parts, workers, kChunkPoints, consume);
    }

    /// Appends the kept points of a chunk.
    void collect(const ArchivePart& part, const Chunk& chunk, Batch& batch) {
        const SourceEntry& source = kept_.sources.sources()[part.range.source];
        if (chunk.first + chunk.positions.size() > source.points) {
            throw_changed(source, fmt::format("at least {}", chunk.first + chunk.positions.size()));
        }
        const PointId first = source.first_id + chunk.first;
        std::vector<std::uint32_t> points;
        for (std::uint32_t i = 0; i < chunk.positions.size(); ++i) {
            if (kept_.selection.test(first + i)) {
                points.push_back(i);
            }
        }
        if (batch.ids.empty()) {
            batch.place = kept_.selection.count_before(first);
        }
        for (const std::uint32_t i : points) {
            batch.ids.push_back(first + i);
            batch.positions.push_back(chunk.positions[i]);
        }
        const std::size_t first_byte = batch.rows.size();
        kept_.attributes.append_rows(part.range.source, chunk, points, batch.rows);
        if (kept_.measures != nullptr) {
            kept_.measures->put(kept_.selection.count_before(first), kept_.attributes,
                                std::span(batch.rows).subspan(first_byte));
        }
        taken_ += points.size();
        report(chunk.positions.size());
    }

    /// @throws InputError if not every kept point was met
    void check_complete() const {
        if (taken_ != kept_.selection.count()) {
            throw InputError(fmt::format(
                "{}{}: expected the sources that were surveyed, found {} of {} kept points",
                kept_.sources.sources().front().info.path.string(),
                kept_.sources.sources().size() > 1 ? " and the other sources" : "", taken_.load(),
                kept_.selection.count()));
        }
    }

  private:
    [[noreturn]] static void throw_changed(const SourceEntry& source, std::string_view found) {
        throw InputError(fmt::format("{}: expected {} points as in the survey, found {}",
                                     source.info.path.string(), source.points, found));
    }

    void report(std::uint64_t points) {
        if (advance_) {
            const std::scoped_lock lock(mutex_);
            advance_(points);
        }
    }

    const KeptPoints& kept_;
    const std::function<void(std::uint64_t)>& advance_;
    StagedReader reader_;
    std::mutex mutex_;
    std::atomic<std::uint64_t> taken_{0};
};

/// Whose turn it is to hand over: parts in their order.
class Turns {
  public:
    bool is_now(std::size_t range) {
        const std::scoped_lock lock(mutex_);
        return next_ == range;
    }

    /// Throws what another thread has failed with: there will be no turn then.
    void wait(std::size_t range) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return next_ == range || error_; });
        if (error_) {
            std::rethrow_exception(error_);
        }
    }

    void pass() {
        const std::scoped_lock lock(mutex_);
        ++next_;
        changed_.notify_all();
    }

    void fail(std::exception_ptr error) {
        const std::scoped_lock lock(mutex_);
        error_ = std::move(error);
        changed_.notify_all();
    }

  private:
    std::mutex mutex_;
    std::condition_variable changed_;
    std::size_t next_ = 0;
    std::exception_ptr error_;
};

std::size_t most_waiting(std::size_t row_size) {
    return std::max<std::size_t>(kWaitingBytes / (sizeof(PointId) + sizeof(Vec3) + row_size), 1);
}

/// Reads one part, and hands over when its turn has come.
void read_in_turn(KeptReader& reader, const ArchivePart& part, std::size_t number, Turns& turns,
                  std::size_t most, const TakeKept& take) {
    Batch batch;
    const auto hand_over = [&] {
        turns.wait(number);
        if (!batch.ids.empty()) {
            take(batch.block());
        }
        batch.clear();
    };
    reader.stream(std::span(&part, 1), 1, [&](std::size_t, std::size_t, const Chunk& chunk) {
        reader.collect(part, chunk, batch);
        if (turns.is_now(number) || batch.ids.size() >= most) {
            hand_over();
        }
    });
    hand_over();
    turns.pass();
}

}  // namespace

void read_sources(const KeptPoints& kept, int workers, const TakeKept& take,
                  const std::function<void(std::uint64_t)>& advance) {
    KeptReader reader(kept, advance);
    const std::vector<ArchivePart> parts = reader.parts_to_read(kRangePoints);
    reader.stream(parts, workers, [&](std::size_t, std::size_t part, const Chunk& chunk) {
        Batch batch;
        reader.collect(parts[part], chunk, batch);
        if (!batch.ids.empty()) {
            take(batch.block());
        }
    });
    reader.check_complete();
}

void read_sources_in_order(const KeptPoints& kept, int workers, const TakeKept& take,
                           const std::function<void(std::uint64_t)>& advance) {
    KeptReader reader(kept, advance);
    const std::vector<ArchivePart> parts = reader.parts_to_read(kOrderedRangePoints);
    Turns turns;
    const std::size_t most = most_waiting(kept.attributes.row_size);
    run_tasks(parts.size(), workers, [&](std::size_t i) {
        try {
            read_in_turn(reader, parts[i], i, turns, most, take);
        } catch (...) {
            turns.fail(std::current_exception());
            throw;
        }
    });
    reader.check_complete();
}

std::uint64_t read_in_order_memory_bytes(int workers, std::size_t row_size) {
    const std::size_t point = sizeof(PointId) + sizeof(Vec3) + row_size;
    // Vectors double; a chunk has the columns beside.
    return static_cast<std::uint64_t>(workers) * (2 * kWaitingBytes + 3 * kChunkPoints * point);
}

}  // namespace knap
