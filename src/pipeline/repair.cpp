#include "pipeline/repair.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

#include "base/memory_gate.hpp"
#include "base/threads.hpp"
#include "knap/error.hpp"
#include "merge/alpha_search.hpp"
#include "merge/merge.hpp"

namespace knap {

namespace {

// Rounds that a number of added points is shared out to, and most rounds of a tolerance.
constexpr int kRounds = 4;
constexpr int kMostRounds = 12;
// Where a limit leaves too few points to add, the next is lower by this.
constexpr int kMostPasses = 3;
constexpr double kLowerLimit = 0.25;
// Points that are looked at for one that is added, and the largest share of all.
constexpr double kSuspectsPerAdded = 12;
constexpr double kMostSuspects = 0.3;
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
        : store_(store), request_(request), advance_(advance), gate_(request.budget_bytes) {
        const double diagonal = request.box.diagonal();
        const double range = std::min(request.range.alpha * request.range.max_factor, diagonal);
        limit_.radius = std::min(kFirstRadius * range, diagonal);
        limit_.farthest = std::min(kFarthest * range, diagonal);
    }

    RepairState run() {
        if (auto saved = store_.saved()) {
            state_ = std::move(*saved);
        } else {
            begin();
        }
        if (!(limit_.farthest > 0)) {
            return std::move(state_);
        }
        for (;;) {
            try {
                add_all();
                return std::move(state_);
            } catch (const DamagedFile& damage) {
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
    struct DamagedFile {
        std::string what;
    };

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
        keep_copies();
        for (; state_.pass < kMostPasses; ++state_.pass) {
            if (!has_tolerance() && missing() == 0) {
                break;
            }
            if (state_.round == 0) {
                find_limit();
                find_suspects();
            }
            limit_.distance = state_.limit;
            add_in_rounds();
            if (has_tolerance()) {
                break;
            }
            state_.round = 0;
            state_.limit *= kLowerLimit;
        }
    }

    // So that kept points near by are read without all the others.
    void keep_copies() {
        copies_.assign(store_.parts(), 0);
        parallel_tasks(store_.parts(), [&](std::size_t part) {
            std::vector<RankedPoint> kept = kept_of(part);
            copies_[part] = kept.size();
            store_.put(part, RepairStore::kKept, std::move(kept));
            advance_(0);
        });
    }

    // Straight from all points.
    std::vector<RankedPoint> kept_of(std::size_t part) {
        std::vector<RankedPoint> kept =
            store_.read(part, [&](const RankedPoint& p) { return state_.selection.test(p.id); });
        for (RankedPoint& point : kept) {
            point.key = 0;
        }
        return kept;
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
        const SampleCells cells(request_.points, request_.spacing);
        std::vector<double> distances;
        std::uint64_t sampled = 0;
        std::mutex mutex;
        limit_.distance = 0;
        parallel_tasks(store_.parts(), [&](std::size_t part) {
            const auto ticket = admit(part);
            std::uint64_t count = 0;
            std::vector<RankedPoint> points = store_.read(part, [&](const RankedPoint& p) {
                const bool inside = cells.contains(p.position);
                count += inside ? 1 : 0;
                return inside && !state_.selection.test(p.id);
            });
            advance_(0);
            const std::vector<RankedPoint> found = violators(std::move(points));
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
        limit_.distance = state_.limit;
        parallel_tasks(store_.parts(), [&](std::size_t part) {
            if (!store_.has_suspects(part, state_)) {
                const auto ticket = admit(part);
                store_.put(part, RepairStore::kSuspects,
                           violators(store_.read(part, [&](const RankedPoint& p) {
                               return !state_.selection.test(p.id);
                           })));
                store_.save_suspects(part, state_);
            }
            advance_(store_.points(part));
        });
    }

    MemoryGate::Ticket admit(std::size_t part) {
        std::uint64_t kept = 0;
        for (std::size_t other = 0; other < store_.parts(); ++other) {
            if (is_near(store_.box(other), store_.box(part), limit_.radius)) {
                kept += copies_[other];
            }
        }
        return gate_.admit(store_.points(part) * violator_bytes_per_point() +
                           kept * violator_bytes_per_kept());
    }

    static bool is_near(const Box& a, const Box& b, double radius) {
        return a.squared_distance_to(b) <= radius * radius;
    }

    std::vector<RankedPoint> violators(std::vector<RankedPoint> points) {
        return find_violators(std::move(points), limit_, [&](const Box& box, double radius) {
            std::vector<RankedPoint> near;
            for (std::size_t part = 0; part < store_.parts(); ++part) {
                if (!is_near(store_.box(part), box, radius)) {
                    continue;
                }
                for (const RankedPoint& point : kept_copy(part)) {
                    if (box.squared_distance_to(point.position) <= radius * radius) {
                        near.push_back(point);
                    }
                }
            }
            return near;
        });
    }

    std::vector<RankedPoint> kept_copy(std::size_t part) {
        try {
            return all_of(part, RepairStore::kKept);
        } catch (const DamagedFile& damage) {
            request_.note(damage.what + "; read from the ranked points instead");
            return kept_of(part);
        }
    }

    std::vector<RankedPoint> all_of(std::size_t part, RepairStore::Kind kind) {
        std::vector<RankedPoint> points;
        try {
            const auto stream = store_.stream(part, kind);
            for (std::vector<RankedPoint> block; stream->next(block);) {
                points.insert(points.end(), block.begin(), block.end());
            }
        } catch (const StorageError& error) {
            throw DamagedFile{error.what()};
        }
        return points;
    }

    void add_in_rounds() {
        const int rounds = has_tolerance() ? kMostRounds : kRounds;
        while (state_.round < rounds) {
            const RepairStore::Kind kind =
                state_.round == 0 ? RepairStore::kSuspects : RepairStore::kViolators;
            const std::vector<std::uint64_t> counts = find_violators_of_round(kind);
            const std::uint64_t most =
                has_tolerance() ? request_.points
                                : missing() / static_cast<std::uint64_t>(rounds - state_.round);
            const std::uint64_t added = add_farthest(kind, counts, most);
            ++state_.round;
            store_.save(state_);
            if (added == 0 && (has_tolerance() || state_.violators == 0)) {
                break;
            }
        }
    }

    std::vector<std::uint64_t> find_violators_of_round(RepairStore::Kind kind) {
        std::vector<std::uint64_t> counts(store_.parts());
        parallel_tasks(store_.parts(), [&](std::size_t part) {
            std::vector<RankedPoint> suspects = all_of(part, RepairStore::kSuspects);
            if (kind == RepairStore::kViolators) {
                std::erase_if(suspects,
                              [&](const RankedPoint& p) { return state_.selection.test(p.id); });
                const auto ticket = admit(part);
                suspects = violators(std::move(suspects));
                counts[part] = suspects.size();
                store_.put(part, kind, std::move(suspects));
            } else {
                counts[part] = suspects.size();
            }
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
    std::uint64_t add_farthest(RepairStore::Kind kind, const std::vector<std::uint64_t>& counts,
                               std::uint64_t most) {
        std::vector<RankedPart> parts;
        for (std::size_t part = 0; part < store_.parts(); ++part) {
            RankedPart ranked;
            ranked.box = store_.box(part);
            ranked.points = counts[part];
            ranked.runs.push_back(store_.stream(part, kind));
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
        copy_added(kind);
        return first.size();
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

    // None of the round's points was kept before.
    void copy_added(RepairStore::Kind kind) {
        parallel_tasks(store_.parts(), [&](std::size_t part) {
            std::vector<RankedPoint> added = all_of(part, kind);
            std::erase_if(added,
                          [&](const RankedPoint& p) { return !state_.selection.test(p.id); });
            if (added.empty()) {
                return;
            }
            std::vector<RankedPoint> kept = kept_before(part, added);
            for (RankedPoint& point : added) {
                point.key = 0;
                kept.push_back(point);
            }
            copies_[part] = kept.size();
            store_.put(part, RepairStore::kKept, std::move(kept));
        });
    }

    std::vector<RankedPoint> kept_before(std::size_t part, const std::vector<RankedPoint>& added) {
        std::vector<RankedPoint> kept = kept_copy(part);
        if (kept.size() != copies_[part]) {
            // From all points, so that the added ones are there already.
            std::vector<PointId> ids;
            for (const RankedPoint& point : added) {
                ids.push_back(point.id);
            }
            std::sort(ids.begin(), ids.end());
            std::erase_if(kept, [&](const RankedPoint& p) {
                return std::binary_search(ids.begin(), ids.end(), p.id);
            });
        }
        return kept;
    }

    RepairStore& store_;
    const RepairRequest& request_;
    const std::function<void(std::uint64_t)>& advance_;
    MemoryGate gate_;
    SurfaceLimit limit_;
    RepairState state_;
    std::vector<std::uint64_t> copies_;
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
