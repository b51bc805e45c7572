#include "merge/merged_stream.hpp"

#include <algorithm>
#include <utility>

namespace knap {

MergedStream::MergedStream(std::vector<std::unique_ptr<RankedStream>> streams) {
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

bool MergedStream::next(std::vector<RankedPoint>& points, std::size_t most) {
    points.clear();
    while (points.size() < most && !heap_.empty()) {
        std::pop_heap(heap_.begin(), heap_.end(), Worse{*this});
        Cursor& best = cursors_[heap_.back()];
        // The best stream stays the best for a while where streams are uneven.
        do {
            points.push_back(best.block[best.at++]);
        } while (points.size() < most && best.at < best.block.size() &&
                 (heap_.size() == 1 || ranks_before(best.block[best.at], head(heap_.front()))));
        if (best.at < best.block.size() || refill(best)) {
            std::push_heap(heap_.begin(), heap_.end(), Worse{*this});
        } else {
            heap_.pop_back();
        }
    }
    return !points.empty();
}

bool MergedStream::refill(Cursor& cursor) {
    cursor.at = 0;
    return cursor.stream->next(cursor.block);
}

}  // namespace knap
