#include "merge/merge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/file.hpp"
#include "base/threads.hpp"
#include "knap/error.hpp"
#include "merge/coverage.hpp"

namespace knap {

namespace {

constexpr std::size_t kSmallestBatch = std::size_t{1} << 12;
constexpr std::size_t kLargestBatch = std::size_t{1} << 18;
constexpr std::size_t kGrain = 1024;

/// All streams as one, by a heap of their next points.
class MergedStream {
  public:
    explicit MergedStream(std::vector<std::unique_ptr<RankedStream>> streams) {
        for (auto& stream : streams) {
            cursors_.push_back({std::move(stream), {}, 0});
        }
        for (std::size_t i = 0; i < cursors_.size(); ++i) {
            if (refill(cursors_[i])) {
                heap_.push_back(i);
            }
        }
        std::make_heap(heap_.begin(), heap_.end(), Worse{*this});
    }

    /// Replaces `batch` by up to `most` points in the global order; false at the end.
    bool next(std::vector<RankedPoint>& batch, std::size_t most) {
        batch.clear();
        while (batch.size() < most && !heap_.empty()) {
            std::pop_heap(heap_.begin(), heap_.end(), Worse{*this});
            Cursor& best = cursors_[heap_.back()];
            // The best stream stays the best for a while where runs are uneven.
            do {
                batch.push_back(best.block[best.at++]);
            } while (batch.size() < most && best.at < best.block.size() &&
                     (heap_.size() == 1 || ranks_before(best.block[best.at], head(heap_.front()))));
            if (best.at < best.block.size() || refill(best)) {
                std::push_heap(heap_.begin(), heap_.end(), Worse{*this});
            } else {
                heap_.pop_back();
            }
        }
        return !batch.empty();
    }

  private:
    struct Cursor {
        std::unique_ptr<RankedStream> stream;
        std::vector<RankedPoint> block;
        std::size_t at;
    };

    static bool refill(Cursor& cursor) {
        cursor.at = 0;
        return cursor.stream->next(cursor.block);
    }

    const RankedPoint& head(std::size_t cursor) const {
        return cursors_[cursor].block[cursors_[cursor].at];
    }

    // A heap's front is its largest, so the order is turned round.
    struct Worse {
        const MergedStream& of;
        bool operator()(std::size_t a, std::size_t b) const {
            return ranks_before(of.head(b), of.head(a));
        }
    };

    std::vector<Cursor> cursors_;
    std::vector<std::size_t> heap_;
};

/// Consecutive points of the global order.
struct Batch {
    std::vector<RankedPoint> points;
    std::vector<std::uint32_t> by_place;  // indices of points, neighbours near each other
    std::vector<std::uint8_t> survives;   // 1: no point kept before the batch marks it
};

// Ten bits an axis, interleaved: near places have near codes.
std::uint32_t place_code(const Vec3& p, const Box& box) {
    constexpr double kCells = 1023;
    std::uint32_t code = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double extent = box.max[axis] - box.min[axis];
        auto cell = static_cast<std::uint32_t>(
            extent > 0 ? (p[axis] - box.min[axis]) / extent * kCells : 0);
        cell = (cell | cell << 16) & 0x030000ff;
        cell = (cell | cell << 8) & 0x0300f00f;
        cell = (cell | cell << 4) & 0x030c30c3;
        cell = (cell | cell << 2) & 0x09249249;
        code |= cell << axis;
    }
    return code;
}

// Looks points up place by place, so that what one look-up brought into the cache serves the next.
void find_survivors(Batch& batch, const Coverage& coverage, const Box& box) {
    const std::size_t n = batch.points.size();
    std::vector<std::uint64_t> codes(n);
    parallel_for(n, kGrain, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            codes[i] = std::uint64_t{place_code(batch.points[i].position, box)} << 32 | i;
        }
    });
    parallel_sort(codes);
    batch.by_place.resize(n);
    batch.survives.assign(n, 0);
    parallel_for(n, kGrain, [&](std::size_t first, std::size_t last) {
        for (std::size_t at = first; at < last; ++at) {
            const auto i = static_cast<std::uint32_t>(codes[at]);
            batch.by_place[at] = i;
            batch.survives[i] = coverage.marks(batch.points[i].position) ? 0 : 1;
        }
    });
}

// Walks the survivors in the method's order. What was kept before does not mark them, so that only
// those of the batch itself have to be asked. Returns the kept ones place by place.
std::vector<RankedPoint> settle(const Batch& batch, const MergeRequest& request) {
    Coverage fresh(request.box);
    std::vector<std::uint8_t> keeps(batch.points.size());
    for (std::size_t i = 0; i < batch.points.size(); ++i) {
        const RankedPoint& point = batch.points[i];
        if (batch.survives[i] != 0 && !fresh.marks(point.position)) {
            fresh.add(point.position, range_of(point.key, request.mean_curvature, request.range));
            keeps[i] = 1;
        }
    }
    std::vector<RankedPoint> kept;
    kept.reserve(fresh.size());
    for (const std::uint32_t i : batch.by_place) {
        if (keeps[i] != 0) {
            kept.push_back(batch.points[i]);
        }
    }
    return kept;
}

void check_memory(const Coverage& coverage, std::uint64_t budget_bytes) {
    if (coverage.memory_bytes() > budget_bytes) {
        throw StorageError(fmt::format(
            "the kept points need more memory than there is: {} for {} of them so far, {} given; "
            "raise resources.memory or range.alpha",
            format_bytes(coverage.memory_bytes()), coverage.size(), format_bytes(budget_bytes)));
    }
}

}  // namespace

double range_of(double curvature, double mean_curvature, const RangeParams& range) {
    const double smallest = range.alpha * range.min_factor;
    const double largest = range.alpha * range.max_factor;
    if (!(curvature > 0)) {
        return largest;
    }
    return std::clamp(range.alpha * mean_curvature / curvature, smallest, largest);
}

MergeResult merge(std::vector<std::unique_ptr<RankedStream>> streams, const MergeRequest& request,
                  const std::function<void(std::uint64_t)>& advance) {
    MergedStream merged(std::move(streams));
    Coverage coverage(request.box);
    MergeResult result;
    result.selection = Selection(request.points);
    Batch batch;
    Batch next;
    std::uint64_t done = 0;
    merged.next(batch.points, kSmallestBatch);
    while (!batch.points.empty()) {
        // Early batches are small: before anything is kept, everything survives.
        const std::uint64_t after = done + batch.points.size();
        const std::size_t size =
            std::clamp(static_cast<std::size_t>(after / 4), kSmallestBatch, kLargestBatch);
        parallel_both([&] { merged.next(next.points, size); },
                      [&] { find_survivors(batch, coverage, request.box); });
        for (const RankedPoint& kept : settle(batch, request)) {
            coverage.add(kept.position, range_of(kept.key, request.mean_curvature, request.range));
            result.selection.set(kept.id);
        }
        check_memory(coverage, request.budget_bytes);
        done = after;
        advance(batch.points.size());
        std::swap(batch, next);
    }
    result.kept = coverage.size();
    result.represented = done - result.kept;
    result.selection.finish();
    return result;
}

}  // namespace knap
