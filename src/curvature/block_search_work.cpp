#include "curvature/block_search_work.hpp"

#include <functional>
#include <queue>
#include <tuple>
#include <utility>

namespace knap {

namespace {

// The square of a distance from any point of one box to any of the other that none exceeds, by the
// arithmetic of squared_distance().
double squared_span(const Box& a, const Box& b) {
    const auto span = [](double a_min, double a_max, double b_min, double b_max) {
        return std::max(b_max - a_min, a_max - b_min);
    };
    const double x = span(a.min.x, a.max.x, b.min.x, b.max.x);
    const double y = span(a.min.y, a.max.y, b.min.y, b.max.y);
    const double z = span(a.min.z, a.max.z, b.min.z, b.max.z);
    return x * x + y * y + z * z;
}

}  // namespace

double sufficient_reach(const BlockSearchWork& work, const Box& box) {
    using Entry = std::pair<double, std::uint32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> nearest;
    nearest.push({0, 0});
    std::size_t count = 0;
    double reach = 0;
    while (count < work.wanted && !nearest.empty()) {
        const std::uint32_t at = nearest.top().second;
        nearest.pop();
        const PointBlocks::Node& node = work.points.nodes[at];
        if (node.right == 0) {
            count += node.end - node.begin;
            reach = std::max(reach, squared_span(box, node.box));
            continue;
        }
        for (const std::uint32_t child : {at + 1, at + node.right}) {
            nearest.push({box.squared_distance_to(work.points.nodes[child].box), child});
        }
    }
    return reach;
}

void settle_ties(BlockSearchWork& work, std::size_t centre, std::size_t near) {
    struct Tied {
        double squared;
        bool other;
        PointId id;
        std::uint64_t which;
        bool operator<(const Tied& b) const {
            return std::tie(squared, other, id) < std::tie(b.squared, b.other, b.id);
        }
    };
    std::vector<Tied> all;
    for (std::size_t i = 0; i < near; ++i) {
        const std::uint64_t place = work.places[work.which[i]];
        all.push_back({work.near[i], place != centre, work.points.ids[place], work.which[i]});
    }
    const auto last = all.begin() + static_cast<std::ptrdiff_t>(work.wanted);
    std::partial_sort(all.begin(), last, all.end());
    for (std::size_t i = 0; i < work.wanted; ++i) {
        work.near[i] = all[i].squared;
        work.which[i] = all[i].which;
    }
}

}  // namespace knap
