#include "emit/kept_points.hpp"

#include <fmt/format.h>

#include <atomic>
#include <mutex>
#include <vector>

#include "input/stream.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

// Long enough that opening a source costs little, short enough that a range without kept points
// can be skipped and threads end together.
constexpr std::uint64_t kRangePoints = 1 << 20;
constexpr std::size_t kChunkPoints = 1 << 14;

class KeptReader {
  public:
    KeptReader(const SourceTable& sources, const Selection& selection, const TakeKept& take,
               const std::function<void(std::uint64_t)>& advance)
        : sources_(sources), selection_(selection), take_(take), advance_(advance) {}

    /// The ranges that hold a kept point; the others are done with at once.
    std::vector<SourceRange> ranges_to_read() {
        std::vector<SourceRange> wanted;
        for (const SourceRange& range : cut_into_ranges(sources_.infos(), kRangePoints)) {
            const SourceEntry& source = sources_.sources()[range.source];
            const PointId first = source.first_id + std::min(range.first, source.points);
            const PointId end =
                first + std::min(range.count, source.first_id + source.points - first);
            if (selection_.count_before(end) != selection_.count_before(first)) {
                wanted.push_back(range);
            } else {
                report(end - first);
            }
        }
        return wanted;
    }

    void consume(const SourceRange& range, const Chunk& chunk) {
        const SourceEntry& source = sources_.sources()[range.source];
        if (chunk.first + chunk.positions.size() > source.points) {
            throw_changed(source, fmt::format("at least {}", chunk.first + chunk.positions.size()));
        }
        std::vector<PointId> ids;
        std::vector<Vec3> kept;
        const PointId first = source.first_id + chunk.first;
        for (std::size_t i = 0; i < chunk.positions.size(); ++i) {
            if (selection_.test(first + i)) {
                ids.push_back(first + i);
                kept.push_back(chunk.positions[i]);
            }
        }
        if (!kept.empty()) {
            taken_ += kept.size();
            take_(selection_.count_before(first), ids, kept);
        }
        report(chunk.positions.size());
    }

    /// @throws InputError if not every kept point was met
    void check_complete() const {
        if (taken_ != selection_.count()) {
            throw InputError(fmt::format(
                "{}{}: expected the sources that were surveyed, found {} of {} kept points",
                sources_.sources().front().info.path.string(),
                sources_.sources().size() > 1 ? " and the other sources" : "", taken_.load(),
                selection_.count()));
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

    const SourceTable& sources_;
    const Selection& selection_;
    const TakeKept& take_;
    const std::function<void(std::uint64_t)>& advance_;
    std::mutex mutex_;
    std::atomic<std::uint64_t> taken_{0};
};

}  // namespace

void read_kept(const SourceTable& sources, const Selection& selection, int workers,
               const TakeKept& take, const std::function<void(std::uint64_t)>& advance) {
    KeptReader reader(sources, selection, take, advance);
    const std::vector<SourceRange> ranges = reader.ranges_to_read();
    const std::vector<SourceInfo> infos = sources.infos();
    if (workers == 1) {
        // One call a range: the order of ranges is then ours and not the scheduler's.
        for (const SourceRange& range : ranges) {
            stream_ranges(infos, std::span(&range, 1), 1, kChunkPoints,
                          [&](std::size_t, std::size_t, const Chunk& chunk) {
                              reader.consume(range, chunk);
                          });
        }
    } else {
        stream_ranges(infos, ranges, workers, kChunkPoints,
                      [&](std::size_t, std::size_t range, const Chunk& chunk) {
                          reader.consume(ranges[range], chunk);
                      });
    }
    reader.check_complete();
}

}  // namespace knap
