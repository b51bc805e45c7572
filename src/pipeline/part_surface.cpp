#include "pipeline/part_surface.hpp"

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>

#include "base/threads.hpp"
#include "knap/error.hpp"
#include "repair/violators.hpp"

namespace knap {

namespace {

bool is_near(const Box& a, const Box& b, double radius) {
    return a.squared_distance_to(b) <= radius * radius;
}

}  // namespace

std::vector<RankedPoint> all_of(RepairStore& store, std::size_t part, RepairStore::Kind kind) {
    std::vector<RankedPoint> points;
    try {
        const auto stream = store.stream(part, kind);
        for (std::vector<RankedPoint> block; stream->next(block);) {
            points.insert(points.end(), block.begin(), block.end());
        }
    } catch (const StorageError& error) {
        throw DamagedRun{error.what()};
    }
    return points;
}

PartSurface::PartSurface(RepairStore& store, const Selection& selection, double radius,
                         double farthest, const std::function<void(const std::string&)>& note)
    : store_(store),
      selection_(selection),
      radius_(radius),
      farthest_(farthest),
      note_(note),
      counts_(store.parts()) {}

void PartSurface::build(const std::function<void(std::uint64_t)>& advance) {
    parallel_tasks(store_.parts(), [&](std::size_t part) {
        std::vector<RankedPoint> kept = kept_of(part);
        counts_[part] = kept.size();
        store_.put(part, RepairStore::kKept, std::move(kept));
        advance(0);
    });
}

// Straight from all points.
std::vector<RankedPoint> PartSurface::kept_of(std::size_t part) {
    std::vector<RankedPoint> kept =
        store_.read(part, [&](const RankedPoint& p) { return selection_.test(p.id); });
    for (RankedPoint& point : kept) {
        point.key = 0;
    }
    return kept;
}

std::vector<RankedPoint> PartSurface::kept_copy(std::size_t part) {
    try {
        return all_of(store_, part, RepairStore::kKept);
    } catch (const DamagedRun& damage) {
        note_(damage.what + "; read from the ranked points instead");
        return kept_of(part);
    }
}

std::vector<RankedPoint> PartSurface::kept_near(const Box& box, double radius) {
    std::vector<RankedPoint> near;
    for (std::size_t part = 0; part < store_.parts(); ++part) {
        if (is_near(store_.box(part), box, radius)) {
            const std::vector<RankedPoint> kept = kept_copy(part);
            std::copy_if(kept.begin(), kept.end(), std::back_inserter(near),
                         [&](const RankedPoint& p) {
                             return box.squared_distance_to(p.position) <= radius * radius;
                         });
        }
    }
    return near;
}

std::vector<RankedPoint> PartSurface::violators(std::vector<RankedPoint> points, double limit) {
    return find_violators(std::move(points),
                          {.distance = limit, .farthest = farthest_, .radius = radius_},
                          [&](const Box& box, double radius) { return kept_near(box, radius); });
}

void PartSurface::add(std::size_t part, std::vector<RankedPoint> added) {
    if (added.empty()) {
        return;
    }
    std::vector<RankedPoint> kept = kept_copy(part);
    if (kept.size() == counts_[part]) {
        for (RankedPoint& point : added) {
            point.key = 0;
            kept.push_back(point);
        }
    }
    // Else the copy was damaged, and what was read instead has the added ones already.
    counts_[part] = kept.size();
    store_.put(part, RepairStore::kKept, std::move(kept));
}

std::uint64_t PartSurface::bytes_for(std::size_t part) const {
    std::uint64_t kept = 0;
    for (std::size_t other = 0; other < store_.parts(); ++other) {
        if (is_near(store_.box(other), store_.box(part), radius_)) {
            kept += counts_[other];
        }
    }
    return store_.points(part) * violator_bytes_per_point() + kept * violator_bytes_per_kept();
}

}  // namespace knap
