#include "pipeline/repair.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

#include "base/checksum.hpp"
#include "base/memory_gate.hpp"
#include "base/threads.hpp"
#include "knap/error.hpp"
#include "merge/merge.hpp"
#include "pipeline/part_surface.hpp"

namespace knap {

namespace {

// Rounds of a pass.
constexpr int kRounds = 4;
// Passes, each over all points: with a tolerance, until nothing is farther; else only where a limit
// leaves too few points to add, with a lower one.
constexpr int kMostPasses = 3;
constexpr int kMostPassesOfTolerance = 16;
constexpr double kLowerLimit = 0.25;
// Points that are looked at for one that is added, and the largest share of all.
constexpr double kSuspectsPerAdded = 12;
constexpr double kMostSuspects = 0.3;
// Points of the sample that foretells how many points are how far off.
constexpr double kSampled = 1 << 13;
// Distance between two points that one round adds, over alpha.
constexpr double kApart = 0.5;
// Over the largest range: how far kept points are looked at, first and at most.
constexpr double kFirstRadius = 4;
constexpr double kFarthest = 8;
// Damaged files are made again so often.
constexpr int kMostAttempts = 3;

class Repairing {
  public:
    Repairing(RepairStore& store, const RepairRequest& request,
              const std::function<void(std::uint64_t)>& advance)
        : store_(store),
          request_(request),
          advance_(advance),
          gate_(request.budget_bytes),
          largest_range_(
              std::min(request.range.alpha * request.range.max_factor, request.box.diagonal())),
          surface_(store, state_.selection, kFirstRadius * largest_range_,
                   kFarthest * largest_range_, request.note) {}

    RepairState run() {
        if (auto saved = store_.saved()) {
            state_ = std::move(*saved);
        } else {
            begin();
        }
        if (!(largest_range_ > 0)) {
            return std::move(state_);
        }
        for (;;) {
            try {
                add_all();
                return std::move(state_);
            } catch (const DamagedRun& damage) {
                if (++state_.attempt >= kMostAttempts) {
                    throw StorageError(damage.what);
                }
                request_.note(damage.what + "; points are added anew");
                begin();
                store_.save(state_);
            }
        }
    }

  private:
    /// A point that a round may add.
    struct Farthest {
        double distance;
        PointId id;
    };

    bool has_tolerance() const { return request_.range.tolerance > 0; }

    std::uint64_t missing() const {
        return request_.wanted > state_.kept ? request_.wanted - state_.kept : 0;
    }

    void begin() {
        state_ = {.attempt = state_.attempt, .kept = request_.kept, .selection = store_.base()};
    }

    void add_all() {
        surface_.build(advance_);
        const int passes = has_tolerance() ? kMostPassesOfTolerance : kMostPasses;
        for (; state_.pass < passes && !state_.done; ++state_.pass) {
            if (!has_tolerance() && missing() == 0) {
                break;
            }
            if (state_.round == 0) {
                find_limit();
                find_suspects();
            }
            add_in_rounds();
            state_.round = 0;
            state_.limit *= kLowerLimit;
        }
    }

    // The tolerance; or the distance that about as many points exceed as are to be looked at, by a
    // sample.
    void find_limit() {
        if (has_tolerance()) {
            state_.limit = request_.range.tolerance;
        } else if (state_.pass == 0 && state_.limit == 0) {
            state_.limit = sampled_limit();
        }
        store_.save(state_);
    }

    double sampled_limit() {
        const auto most_hash = static_cast<std::uint64_t>(
            std::min(1.0, kSampled / static_cast<double>(request_.points)) *
            static_cast<double>(std::uint64_t{1} << 63));
        std::vector<double> distances;
        std::uint64_t sampled = 0;
        std::mutex mutex;
        parallel_tasks(store_.parts(), [&](std::size_t part) {
            const auto ticket = gate_.admit(surface_.bytes_for(part));
            std::uint64_t count = 0;
            std::vector<RankedPoint> points = store_.read(part, [&](const RankedPoint& p) {
                const bool inside = splitmix64(p.id) >> 1 <= most_hash;
                count += inside ? 1 : 0;
                return inside && !state_.selection.test(p.id);
            });
            advance_(0);
            const std::vector<RankedPoint> found = surface_.violators(std::move(points), 0);
            const std::scoped_lock lock(mutex);
            sampled += count;
            for (const RankedPoint& point : found) {
                distances.push_back(point.key);
            }
        });
        const double share =
            std::min(kMostSuspects, kSuspectsPerAdded * static_cast<double>(missing()) /
                                        static_cast<double>(request_.points));
        const auto above = static_cast<std::size_t>(share * static_cast<double>(sampled));
        if (above >= distances.size()) {
            return 0;
        }
        std::nth_element(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(above),
                         distances.end(), std::greater<>());
        return distances[above];
    }

    void find_suspects() {
        parallel_tasks(store_.parts(), [&](std::size_t part) {
            if (!store_.has_suspects(part, state_)) {
                const auto ticket = gate_.admit(surface_.bytes_for(part));
                store_.put(part, RepairStore::kSuspects,
                           surface_.violators(store_.read(part,
                                                          [&](const RankedPoint& p) {
                                                              return !state_.selection.test(p.id);
                                                          }),
                                              state_.limit));
                store_.save_suspects(part, state_);
            }
            advance_(store_.points(part));
        });
    }

    void add_in_rounds() {
        while (state_.round < kRounds) {
            const std::vector<std::uint64_t> counts = find_violators();
            const std::uint64_t most =
                has_tolerance() ? request_.points
                                : missing() / static_cast<std::uint64_t>(kRounds - state_.round);
            add_farthest(counts, most);
            // Nothing is farther: of all points, or of those that were when the pass began.
            state_.done = has_tolerance() && state_.round == 0 && state_.violators == 0;
            state_.round = state_.violators == 0 ? kRounds : state_.round + 1;
            store_.save(state_);
        }
    }

    // Of the suspects, those that still are too far away take their place; how many in each part.
    std::vector<std::uint64_t> find_violators() {
        std::vector<std::uint64_t> counts(store_.parts());
        parallel_tasks(store_.parts(), [&](std::size_t part) {
            std::vector<RankedPoint> suspects = all_of(store_, part, RepairStore::kSuspects);
            if (state_.round > 0) {
                std::erase_if(suspects,
                              [&](const RankedPoint& p) { return state_.selection.test(p.id); });
                const auto ticket = gate_.admit(surface_.bytes_for(part));
                suspects = surface_.violators(std::move(suspects), state_.limit);
                store_.put(part, RepairStore::kSuspects, suspects);
            }
            counts[part] = suspects.size();
            advance_(0);
        });
        state_.violators = 0;
        for (const std::uint64_t count : counts) {
            state_.violators += count;
        }
        return counts;
    }

    // Walks them in the order of their distances, a fixed range each, and adds the first that the
    // walk keeps.
    void add_farthest(const std::vector<std::uint64_t>& counts, std::uint64_t most) {
        std::vector<RankedPart> parts;
        for (std::size_t part = 0; part < store_.parts(); ++part) {
            RankedPart ranked;
            ranked.box = store_.box(part);
            ranked.points = counts[part];
            ranked.runs.push_back(store_.stream(part, RepairStore::kSuspects));
            parts.push_back(std::move(ranked));
        }
        std::vector<Farthest> first;
        std::mutex mutex;
        const auto take = [&](std::span<const RankedPoint> kept) {
            const std::scoped_lock lock(mutex);
            for (const RankedPoint& point : kept) {
                first.push_back({point.key, point.id});
            }
            constexpr std::uint64_t kSlack = std::uint64_t{1} << 16;
            if (first.size() > 2 * most + kSlack) {
                keep_first(first, most);
            }
        };
        MergeRequest request;
        request.range = {.alpha = kApart * request_.range.alpha, .min_factor = 1, .max_factor = 1};
        request.mean_curvature = 1;
        request.points = request_.ids;
        request.box = request_.box;
        request.budget_bytes = request_.budget_bytes -
                               std::min(request_.budget_bytes,
                                        2 * std::min(most, state_.violators) * sizeof(Farthest));
        request.on_settled = [&](std::size_t part, std::span<const RankedPoint> kept,
                                 std::vector<RankedPoint> open) -> std::unique_ptr<RankedStream> {
            take(kept);
            if (open.empty()) {
                return nullptr;
            }
            store_.put(part, RepairStore::kOpen, std::move(open));
            return store_.stream(part, RepairStore::kOpen);
        };
        request.on_walked = take;
        merge(std::move(parts), request, [&](std::uint64_t) { advance_(0); });
        keep_first(first, most);
        for (const Farthest& point : first) {
            state_.selection.set(point.id);
        }
        state_.kept += first.size();
        parallel_tasks(store_.parts(), [&](std::size_t part) {
            // None of them was kept before.
            std::vector<RankedPoint> added = all_of(store_, part, RepairStore::kSuspects);
            std::erase_if(added,
                          [&](const RankedPoint& p) { return !state_.selection.test(p.id); });
            surface_.add(part, std::move(added));
        });
    }

    static void keep_first(std::vector<Farthest>& points, std::uint64_t most) {
        if (points.size() > most) {
            std::nth_element(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(most),
                             points.end(), [](const Farthest& a, const Farthest& b) {
                                 return ranks_before(a.distance, a.id, b.distance, b.id);
                             });
            points.resize(most);
        }
    }

    RepairStore& store_;
    const RepairRequest& request_;
    const std::function<void(std::uint64_t)>& advance_;
    MemoryGate gate_;
    double largest_range_;
    RepairState state_;
    PartSurface surface_;
};

}  // namespace

bool repairs(const RangeParams& range) {
    return range.repair > 0 || range.tolerance > 0;
}

std::uint64_t wanted_before_repair(const RangeParams& range, std::uint64_t wanted) {
    return wanted -
           static_cast<std::uint64_t>(std::floor(range.repair * static_cast<double>(wanted)));
}

std::uint64_t wanted_after_repair(const RangeParams& range, std::uint64_t kept) {
    return static_cast<std::uint64_t>(std::floor(static_cast<double>(kept) / (1 - range.repair)));
}

RepairState repair(RepairStore& store, const RepairRequest& request,
                   const std::function<void(std::uint64_t)>& advance) {
    return Repairing(store, request, advance).run();
}

}  // namespace knap
