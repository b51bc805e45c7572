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
constexpr std::size_t kLargestBatch = std::size_t{1} << 16;
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
    std::vector<RankedPoint> batch;
    std::vector<std::uint8_t> survives;
    std::uint64_t done = 0;
    // Early batches are small: before anything is kept, everything survives.
    for (std::size_t size = kSmallestBatch; merged.next(batch, size);
         size = std::clamp(static_cast<std::size_t>(done / 4), kSmallestBatch, kLargestBatch)) {
        survives.assign(batch.size(), 0);
        parallel_for(batch.size(), kGrain, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                survives[i] = coverage.marks(batch[i].position) ? 0 : 1;
            }
        });
        for (std::size_t i = 0; i < batch.size(); ++i) {
            if (survives[i] != 0 && !coverage.marks(batch[i].position)) {
                coverage.add(batch[i].position,
                             range_of(batch[i].key, request.mean_curvature, request.range));
                result.selection.set(batch[i].id);
            }
        }
        if (coverage.memory_bytes() > request.budget_bytes) {
            throw StorageError(fmt::format(
                "the kept points need more memory than there is: {} for {} of them so far, {} given; "
                "raise resources.memory or range.alpha",
                format_bytes(coverage.memory_bytes()), coverage.size(),
                format_bytes(request.budget_bytes)));
        }
        done += batch.size();
        advance(batch.size());
    }
    result.kept = coverage.size();
    result.represented = done - result.kept;
    result.selection.finish();
    return result;
}

}  // namespace knap
