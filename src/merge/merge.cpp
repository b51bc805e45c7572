#include "merge/merge.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

#include "base/memory_gate.hpp"
#include "base/threads.hpp"
#include "merge/merged_stream.hpp"
#include "merge/settle.hpp"
#include "merge/stream_walk.hpp"

namespace knap {

namespace {

class Merger {
  public:
    Merger(std::vector<RankedPart> parts, const MergeRequest& request,
           const std::function<void(std::uint64_t)>& advance)
        : parts_(std::move(parts)),
          request_(request),
          advance_(advance),
          gate_(request.budget_bytes) {
        for (const RankedPart& part : parts_) {
            boxes_.push_back(part.box);
        }
        result_.selection = Selection(request.points);
    }

    MergeResult merge() {
        parallel_tasks(parts_.size(), [&](std::size_t i) {
            const auto ticket = gate_.admit(parts_[i].points * merge_bytes_per_point());
            settle_part(i);
        });
        std::erase(open_, nullptr);
        walk_streams(
            std::move(open_), request_, [&](PointId id) { keep(id); }, advance_);
        std::uint64_t counted = 0;
        for (const RankedPart& part : parts_) {
            counted += part.points;
        }
        result_.represented = counted - result_.kept;
        result_.selection.finish();
        return std::move(result_);
    }

  private:
    void settle_part(std::size_t i) {
        SettledPart settled = parts_[i].settled ? parts_[i].settled() : settle_now(i);
        const std::scoped_lock lock(mutex_);
        for (const PointId id : settled.kept) {
            keep(id);
        }
        if (settled.open != nullptr) {
            open_.push_back(std::move(settled.open));
        }
        advance_(parts_[i].points - settled.open_points);
    }

    SettledPart settle_now(std::size_t i) {
        const std::vector<RankedPoint> points = take_points(parts_[i]);
        const Settled settled = settle(ranged(points), boxes_in_reach(i, points));
        SettledPart result;
        for (const std::uint32_t place : settled.kept) {
            result.kept.push_back(points[place].id);
        }
        std::sort(result.kept.begin(), result.kept.end());
        std::vector<RankedPoint> open;
        open.reserve(settled.open.size());
        for (const std::uint32_t place : settled.open) {
            open.push_back(points[place]);
        }
        result.open_points = open.size();
        result.open = request_.on_settled(i, result.kept, std::move(open));
        return result;
    }

    static std::vector<RankedPoint> take_points(RankedPart& part) {
        std::vector<RankedPoint> points;
        points.reserve(part.points);
        MergedStream(std::exchange(part.runs, {})).next(points, part.points);
        return points;
    }

    std::vector<RangedPoint> ranged(const std::vector<RankedPoint>& points) const {
        std::vector<RangedPoint> ranged;
        ranged.reserve(points.size());
        for (const RankedPoint& p : points) {
            ranged.push_back({p.position, range(p)});
        }
        return ranged;
    }

    // Of the other parts that a ball of this one could touch. The last range is the largest.
    std::vector<Box> boxes_in_reach(std::size_t i, const std::vector<RankedPoint>& points) const {
        std::vector<Box> near;
        const double reach = points.empty() ? 0 : range(points.back());
        for (std::size_t other = 0; other < boxes_.size(); ++other) {
            if (other != i && boxes_[i].squared_distance_to(boxes_[other]) <= reach * reach) {
                near.push_back(boxes_[other]);
            }
        }
        return near;
    }

    double range(const RankedPoint& p) const {
        return range_of(p.key, request_.mean_curvature, request_.range);
    }

    void keep(PointId id) {
        result_.selection.set(id);
        ++result_.kept;
    }

    std::vector<RankedPart> parts_;
    const MergeRequest& request_;
    const std::function<void(std::uint64_t)>& advance_;
    MemoryGate gate_;
    std::vector<Box> boxes_;
    std::mutex mutex_;
    std::vector<std::unique_ptr<RankedStream>> open_;
    MergeResult result_;
};

}  // namespace

std::unique_ptr<RankedStream> hold_in_memory(std::size_t /*part*/,
                                             std::span<const PointId> /*kept*/,
                                             std::vector<RankedPoint> open) {
    return open.empty() ? nullptr : std::make_unique<RunInMemory>(std::move(open));
}

double range_of(double curvature, double mean_curvature, const RangeParams& range) {
    const double smallest = range.alpha * range.min_factor;
    const double largest = range.alpha * range.max_factor;
    if (!(curvature > 0)) {
        return largest;
    }
    return std::clamp(range.alpha * mean_curvature / curvature, smallest, largest);
}

std::uint64_t merge_bytes_per_point() {
    // The points, with ranges, and where each is; the open ones once more, with their coverage.
    return sizeof(RankedPoint) + sizeof(RangedPoint) + 4 * sizeof(std::uint32_t);
}

MergeResult merge(std::vector<RankedPart> parts, const MergeRequest& request,
                  const std::function<void(std::uint64_t)>& advance) {
    return Merger(std::move(parts), request, advance).merge();
}

}  // namespace knap
