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

// Keeps the k best by (distance, id) of what the tree offers.
class SettledSet final : public flann::ResultSet<double> {
  public:
    SettledSet(std::span<const PointId> ids, PointId self, std::size_t k, double max_squared,
               std::vector<Neighbour>& best)
        : ids_(ids), self_(self), k_(k), max_squared_(max_squared), best_(best) {
        best_.clear();
        set_limit(max_squared);
    }

    bool full() const override { return best_.size() == k_; }
    double worstDist() const override { return limit_; }

    void addPoint(double squared_distance, std::size_t index) override {
        const Neighbour found{squared_distance, ids_[index], static_cast<std::uint32_t>(index)};
        if (found.id == self_ || squared_distance > max_squared_) {
            return;
        }
        if (best_.size() == k_) {
            if (!(found < best_.back())) {
                return;
            }
            best_.pop_back();
        }
        std::size_t at = best_.size();
        best_.push_back(found);
        for (; at > 0 && found < best_[at - 1]; --at) {
            best_[at] = best_[at - 1];
        }
        best_[at] = found;
        if (best_.size() == k_) {
            set_limit(best_.back().squared_distance);
        }
    }

  private:
    void set_limit(double squared) {
        limit_ = squared * kMargin + std::numeric_limits<double>::min();
    }

    std::span<const PointId> ids_;
    PointId self_;
    std::size_t k_;
    double max_squared_;
    std::vector<Neighbour>& best_;
    double limit_ = 0;
};

}  // namespace

struct NeighbourSearch::Tree {
    explicit Tree(std::span<const Vec3> points)
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
    SettledSet best(ids_, self, k, max_squared, result);
    if (tree_ && k > 0) {
        tree_->index.findNeighbors(best, &query.x, flann::SearchParams(flann::FLANN_CHECKS_UNLIMITED));
    }
}

}  // namespace knap
