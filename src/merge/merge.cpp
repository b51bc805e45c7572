#include "merge/merge.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

#include "base/memory_gate.hpp"
#include "base/threads.hpp"
#include "knap/error.hpp"
#include "merge/merged_stream.hpp"
#include "merge/range_law.hpp"
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
          range_(request.range, request.mean_curvature),
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
        const auto walked = [&](std::span<const RankedPoint> kept) {
            keep(kept);
            request_.on_walked(kept);
        };
        walk_streams(std::move(open_), request_, walked, advance_);
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
        SettledPart settled = part(i);
        const std::scoped_lock lock(mutex_);
        keep(settled.kept);
        if (settled.open != nullptr) {
            open_.push_back(std::move(settled.open));
        }
        advance_(parts_[i].points - settled.open_points);
    }

    SettledPart part(std::size_t i) {
        RankedPart& part = parts_[i];
        std::vector<RankedPoint> points;
        try {
            if (part.settled) {
                return part.settled();
            }
            points = take_points(part);
        } catch (const StorageError& error) {
            if (!part.remake) {
                throw;
            }
            points = part.remake(error.what());
        }
        return settle_now(i, points);
    }

    SettledPart settle_now(std::size_t i, const std::vector<RankedPoint>& points) {
        const std::vector<Fate> fates = settle(points, range_, boxes_in_reach(i, points));
        SettledPart result;
        std::vector<RankedPoint> open;
        for (std::size_t place = 0; place < points.size(); ++place) {
            if (fates[place] == Fate::kKept) {
                result.kept.push_back(points[place]);
            } else if (fates[place] == Fate::kOpen) {
                open.push_back(points[place]);
            }
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

    // Of the other parts that a region of this one could touch. The last one reaches farthest.
    std::vector<Box> boxes_in_reach(std::size_t i, const std::vector<RankedPoint>& points) const {
        std::vector<Box> near;
        const double reach = points.empty() ? 0 : range_.reach(points.back().key);
        for (std::size_t other = 0; other < boxes_.size(); ++other) {
            if (other != i && boxes_[i].squared_distance_to(boxes_[other]) <= reach * reach) {
                near.push_back(boxes_[other]);
            }
        }
        return near;
    }

    void keep(std::span<const RankedPoint> points) {
        for (const RankedPoint& point : points) {
            result_.selection.set(point.id);
        }
        result_.kept += points.size();
    }

    std::vector<RankedPart> parts_;
    const MergeRequest& request_;
    const std::function<void(std::uint64_t)>& advance_;
    RangeLaw range_;
    MemoryGate gate_;
    std::vector<Box> boxes_;
    std::mutex mutex_;
    std::vector<std::unique_ptr<RankedStream>> open_;
    MergeResult result_;
};

}  // namespace

std::unique_ptr<RankedStream> hold_in_memory(std::size_t /*part*/,
                                             std::span<const RankedPoint> /*kept*/,
                                             std::vector<RankedPoint> open) {
    return open.empty() ? nullptr : std::make_unique<RunInMemory>(std::move(open));
}

std::uint64_t merge_bytes_per_point() {
    // The points, and what settling them takes; the kept and the open ones once more.
    return 2 * sizeof(RankedPoint) + settle_bytes_per_point();
}

MergeResult merge(std::vector<RankedPart> parts, const MergeRequest& request,
                  const std::function<void(std::uint64_t)>& advance) {
    return Merger(std::move(parts), request, advance).merge();
}

}  // namespace knap
