#include "emit/kept_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <stdexcept>
#include <vector>

#include "base/threads.hpp"
#include "input/stream.hpp"
#include "knap/error.hpp"
#include "store/ranked_run.hpp"

namespace knap {

namespace {

// Long enough that opening a source costs little, short enough that a range without kept points
// can be skipped and threads end together.
constexpr std::uint64_t kRangePoints = 1 << 20;
constexpr std::size_t kChunkPoints = 1 << 14;

/// Of the sources.
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

void read_from_sources(const KeptPoints& kept, int workers, const TakeKept& take,
                       const std::function<void(std::uint64_t)>& advance) {
    KeptReader reader(kept.sources, kept.selection, take, advance);
    const std::vector<SourceRange> ranges = reader.ranges_to_read();
    const std::vector<SourceInfo> infos = kept.sources.infos();
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

/// A run does not hold what merge has left there.
class DamagedRun : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// The next points of a run; false at its end.
bool next_of(RunReader& reader, std::vector<RankedPoint>& block) {
    try {
        return reader.next(block);
    } catch (const StorageError& error) {
        throw DamagedRun(error.what());
    }
}

/// Hands over the kept points of one run.
/// @param next_place  of all runs
void read_run(const KeptPoints& kept, const std::filesystem::path& run,
              std::atomic<std::uint64_t>& next_place, const TakeKept& take,
              const std::function<void(std::uint64_t)>& advance) {
    RunReader reader(run, kept.sources);
    std::vector<PointId> ids;
    std::vector<Vec3> positions;
    for (std::vector<RankedPoint> block; next_of(reader, block);) {
        ids.clear();
        positions.clear();
        for (const RankedPoint& point : block) {
            if (point.id < kept.selection.size() && kept.selection.test(point.id)) {
                ids.push_back(point.id);
                positions.push_back(point.position);
            }
        }
        const std::uint64_t place = next_place.fetch_add(ids.size());
        if (place + ids.size() > kept.selection.count()) {
            throw DamagedRun(
                fmt::format("{}: scratch file is damaged: expected each kept point "
                            "once in all runs, found more",
                            run.string()));
        }
        if (!ids.empty()) {
            take(place, ids, positions);
            advance(ids.size());
        }
    }
}

void read_from_runs(const KeptPoints& kept, int workers, const TakeKept& take,
                    const std::function<void(std::uint64_t)>& advance) {
    std::atomic<std::uint64_t> next_place = 0;
    std::mutex mutex;
    std::uint64_t taken = 0;
    std::uint64_t told = 0;
    const auto advance_inputs = [&](std::uint64_t points) {
        const std::scoped_lock lock(mutex);
        taken += points;
        const double share =
            static_cast<double>(taken) / static_cast<double>(kept.selection.count());
        const auto now =
            static_cast<std::uint64_t>(share * static_cast<double>(kept.sources.points()));
        advance(now - told);
        told = now;
    };
    run_tasks(kept.runs.size(), workers, [&](std::size_t i, std::size_t) {
        read_run(kept, kept.runs[i], next_place, take, advance_inputs);
    });
    if (next_place != kept.selection.count()) {
        throw DamagedRun(fmt::format("{} and other runs: expected {} kept points, found {}",
                                     kept.runs.front().string(), kept.selection.count(),
                                     next_place.load()));
    }
}

}  // namespace

void read_kept(const KeptPoints& kept, int workers, const std::function<TakeKept()>& begin,
               const std::function<void(std::uint64_t)>& advance) {
    std::uint64_t told = 0;
    if (!kept.runs.empty()) {
        try {
            read_from_runs(kept, workers, begin(), [&](std::uint64_t points) {
                told += points;
                advance(points);
            });
            return;
        } catch (const DamagedRun& error) {
            kept.note(std::string(error.what()) + "; kept points are read from the sources again");
        }
    }
    // What was told does not count again.
    read_from_sources(kept, workers, begin(), [&](std::uint64_t points) {
        const std::uint64_t known = std::min(points, told);
        told -= known;
        advance(points - known);
    });
}

void read_kept_in_order(const KeptPoints& kept, const TakeKept& take,
                        const std::function<void(std::uint64_t)>& advance) {
    read_from_sources(kept, 1, take, advance);
}

}  // namespace knap
