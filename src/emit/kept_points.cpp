#include "emit/kept_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <stdexcept>
#include <vector>

#include "base/threads.hpp"
#include "emit/kept_sources.hpp"
#include "knap/error.hpp"
#include "store/ranked_run.hpp"

namespace knap {

namespace {

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
            take({place, ids, positions, {}});
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
    if (!kept.runs.empty() && kept.attributes.empty()) {
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
    read_sources(kept, workers, begin(), [&](std::uint64_t points) {
        const std::uint64_t known = std::min(points, told);
        told -= known;
        advance(points - known);
    });
}

void read_kept_in_order(const KeptPoints& kept, int workers, const TakeKept& take,
                        const std::function<void(std::uint64_t)>& advance) {
    read_sources_in_order(kept, workers, take, advance);
}

}  // namespace knap
