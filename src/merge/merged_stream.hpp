#pragma once

#include <memory>
#include <vector>

#include "store/ranked_run.hpp"

namespace knap {

/// Several streams as one in the method's order, by a heap of their next points.
class MergedStream {
  public:
    /// @param streams  each in the method's order
    explicit MergedStream(std::vector<std::unique_ptr<RankedStream>> streams);

    /// Replaces `points` by up to `most` of the next ones; false, with none, at the end.
    bool next(std::vector<RankedPoint>& points, std::size_t most);

  private:
    struct Cursor {
        std::unique_ptr<RankedStream> stream;
        std::vector<RankedPoint> block;
        std::size_t at;
    };

    // A heap's front is its largest, so the order is turned round.
    struct Worse {
        const MergedStream& of;
        bool operator()(std::size_t a, std::size_t b) const {
            return ranks_before(of.head(b), of.head(a));
        }
    };

    static bool refill(Cursor& cursor);
    const RankedPoint& head(std::size_t cursor) const {
        return cursors_[cursor].block[cursors_[cursor].at];
    }

    std::vector<Cursor> cursors_;
    std::vector<std::size_t> heap_;
};

}  // namespace knap
