#include "curvature/neighbour_search.hpp"

#include <algorithm>
#include <flann/flann.hpp>

namespace knap {

namespace {

using Metric = flann::L2_Simple<double>;
using Index = flann::KDTreeSingleIndex<Metric>;

constexpr int kLeafSize = 12;

// The tree adds up its lower bounds in another order than squared_distance() does. This margin is
// far above the rounding of either, so that no point that could tie with the k-th is cut off.
constexpr double kMargin = 1 + 1e-9;

// Keeps the k best by (distance, id) of what the tree offers, in order.
class SettledSet final : public flann::ResultSet<double> {
  public:
    /// @param best  k places
    SettledSet(std::span<const PointId> ids, PointId self, double max_squared,
               std::span<Neighbour> best)
        : ids_(ids), self_(self), max_squared_(max_squared), best_(best.data()), k_(best.size()) {
        set_limit(max_squared);
    }

    std::size_t size() const { return size_; }
    bool full() const override { return size_ == k_; }
    double worstDist() const override { return limit_; }

    void addPoint(double squared_distance, std::size_t index) override {
        const Neighbour found{squared_distance, static_cast<std::uint32_t>(index)};
        // The point itself is at distance 0, like no other: coincident points are merged, but
        // distances below 1e-162 have no square.
        if (squared_distance > max_squared_ || (squared_distance == 0 && ids_[index] == self_)) {
            return;
        }
        std::size_t at = size_;
        if (at == k_) {
            --at;
            if (!before(found, best_[at])) {
                return;
            }
        } else {
            ++size_;
        }
        for (; at > 0 && before(found, best_[at - 1]); --at) {
            best_[at] = best_[at - 1];
        }
        best_[at] = found;
        if (size_ == k_) {
            set_limit(best_[k_ - 1].squared_distance);
        }
    }

  private:
    // By (distance, id). Ids are looked up only where distances are equal.
    bool before(const Neighbour& a, const Neighbour& b) const {
        return a.squared_distance < b.squared_distance ||
               (a.squared_distance == b.squared_distance && ids_[a.index] < ids_[b.index]);
    }

    void set_limit(double squared) {
        limit_ = squared * kMargin + std::numeric_limits<double>::min();
    }

    std::span<const PointId> ids_;
    PointId self_;
    double max_squared_;
    Neighbour* best_;
    std::size_t k_;
    std::size_t size_ = 0;
    double limit_ = 0;
};

}  // namespace

struct NeighbourSearch::Tree {
    explicit Tree(std::span<const Vec3> points)
        // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast): FLANN's matrix has no const form.
        : index(flann::Matrix<double>(const_cast<double*>(&points[0].x), points.size(), 3),
                flann::KDTreeSingleIndexParams(kLeafSize, true)) {
        static_assert(sizeof(Vec3) == 3 * sizeof(double));
        index.buildIndex();
    }

    Index index;
};

NeighbourSearch::NeighbourSearch(std::span<const Vec3> points, std::span<const PointId> ids)
    : points_(points), ids_(ids) {
    if (!points.empty()) {
        tree_ = std::make_unique<Tree>(points);
    }
}

NeighbourSearch::~NeighbourSearch() = default;

void NeighbourSearch::nearest(const Vec3& query, PointId self, std::size_t k,
                              std::vector<Neighbour>& result, double max_squared) const {
    result.resize(k);
    SettledSet best(ids_, self, max_squared, result);
    if (tree_ && k > 0) {
        tree_->index.findNeighbors(best, &query.x,
                                   flann::SearchParams(flann::FLANN_CHECKS_UNLIMITED));
    }
    result.resize(best.size());
}

}  // namespace knap
