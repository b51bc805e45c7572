#include "curvature/point_blocks.hpp"

#include <algorithm>
#include <array>
#include <tuple>

#include "base/threads.hpp"

namespace knap {

namespace {

constexpr std::size_t kParallelPoints = std::size_t{1} << 16;
constexpr std::size_t kMostSamples = 65;

using Nodes = std::vector<PointBlocks::Node>;

class Builder {
  public:
    explicit Builder(std::vector<TaggedPoint>& points) : points_(points) {}

    /// Sorts points [begin, end) into blocks; their nodes, the root first.
    Nodes build(std::size_t begin, std::size_t end) const {
        Nodes nodes;
        if (end - begin > kParallelPoints) {
            const Box box = box_of(begin, end);
            const std::size_t middle = halve(begin, end, box);
            if (middle > begin) {
                Nodes right;
                parallel_both([&] { nodes = build(begin, middle); },
                              [&] { right = build(middle, end); });
                nodes.insert(nodes.begin(), node(box, begin, end, nodes.size() + 1));
                nodes.insert(nodes.end(), right.begin(), right.end());
                return nodes;
            }
        }
        append(begin, end, nodes);
        return nodes;
    }

  private:
    static PointBlocks::Node node(const Box& box, std::size_t begin, std::size_t end,
                                  std::size_t right) {
        return {box, static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end),
                static_cast<std::uint32_t>(right)};
    }

    void append(std::size_t begin, std::size_t end, Nodes& nodes) const {
        const Box box = box_of(begin, end);
        const std::size_t at = nodes.size();
        nodes.push_back(node(box, begin, end, 0));
        if (end - begin <= PointBlocks::kBlockPoints) {
            return;
        }
        const std::size_t middle = halve(begin, end, box);
        if (middle == begin) {
            return;
        }
        append(begin, middle, nodes);
        nodes[at].right = static_cast<std::uint32_t>(nodes.size() - at);
        append(middle, end, nodes);
    }

    Box box_of(std::size_t begin, std::size_t end) const {
        Box box;
        for (std::size_t i = begin; i < end; ++i) {
            box.extend(points_[i].position);
        }
        return box;
    }

    // Puts the points before a face across the longest axis in front; returns where the others
    // begin: `begin` if all points coincide. Equal coordinates stay together.
    std::size_t halve(std::size_t begin, std::size_t end, const Box& box) const {
        const int axis = box.longest_axis();
        std::array<double, kMostSamples> sample{};
        const std::size_t count = end - begin;
        const std::size_t taken = count > 2048 ? kMostSamples : count > 256 ? 33 : 17;
        for (std::size_t i = 0; i < taken; ++i) {
            sample[i] = points_[begin + i * count / taken].position[axis];
        }
        const std::span values = std::span(sample).first(taken);
        std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(taken / 2),
                         values.end());
        const double median = values[taken / 2];
        const double face = median > box.min[axis] ? median : box.max[axis];
        // Every point goes to the front and moves the front on where it belongs there: no branch
        // to guess.
        std::size_t front = begin;
        for (std::size_t i = begin; i < end; ++i) {
            const TaggedPoint point = points_[i];
            points_[i] = points_[front];
            points_[front] = point;
            front += point.position[axis] < face ? 1 : 0;
        }
        return front;
    }

    std::vector<TaggedPoint>& points_;
};

bool same_place(const TaggedPoint& a, const TaggedPoint& b) {
    return a.position == b.position;
}

bool has_coincident(std::span<const TaggedPoint> block) {
    for (std::size_t i = 1; i < block.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            if (block[i].position.x == block[j].position.x && same_place(block[i], block[j])) {
                return true;
            }
        }
    }
    return false;
}

std::uint64_t count_core(std::span<const TaggedPoint> block) {
    return static_cast<std::uint64_t>(std::count_if(
        block.begin(), block.end(), [](const TaggedPoint& point) { return point.is_core(); }));
}

// All coincident points are in one block. Those that stay, in front.
std::span<const TaggedPoint> merge_coincident(std::span<TaggedPoint> block) {
    if (block.size() <= PointBlocks::kBlockPoints && !has_coincident(block)) {
        return block;
    }
    std::sort(block.begin(), block.end(), [](const TaggedPoint& a, const TaggedPoint& b) {
        return std::tuple(a.position.x, a.position.y, a.position.z, a.id()) <
               std::tuple(b.position.x, b.position.y, b.position.z, b.id());
    });
    return block.first(static_cast<std::size_t>(
        std::unique(block.begin(), block.end(), same_place) - block.begin()));
}

}  // namespace

PointBlocks make_blocks(std::vector<TaggedPoint> points) {
    PointBlocks result;
    if (!points.empty()) {
        result.nodes = Builder(points).build(0, points.size());
    }
    result.ids.reserve(points.size());
    result.is_core.reserve(points.size());
    for (std::vector<double>* axis : {&result.x, &result.y, &result.z}) {
        axis->reserve(points.size() + PointBlocks::kPadding);
    }
    for (std::size_t at = 0; at < result.nodes.size(); ++at) {
        PointBlocks::Node& node = result.nodes[at];
        const std::span block = std::span(points).subspan(node.begin, node.end - node.begin);
        node.begin = static_cast<std::uint32_t>(result.ids.size());
        if (node.right != 0) {
            continue;
        }
        result.blocks.push_back(static_cast<std::uint32_t>(at));
        const std::uint64_t core = count_core(block);
        const std::span<const TaggedPoint> distinct = merge_coincident(block);
        for (const TaggedPoint& point : distinct) {
            result.x.push_back(point.position.x);
            result.y.push_back(point.position.y);
            result.z.push_back(point.position.z);
            result.ids.push_back(point.id());
            result.is_core.push_back(point.is_core() ? 1 : 0);
        }
        result.core_count += count_core(distinct);
        result.merged += core - count_core(distinct);
        node.end = static_cast<std::uint32_t>(result.ids.size());
    }
    // A node ends where the last node of its right subtree does.
    for (std::size_t at = result.nodes.size(); at-- > 0;) {
        if (result.nodes[at].right != 0) {
            result.nodes[at].end = result.nodes[at + result.nodes[at].right].end;
        }
    }
    for (std::vector<double>* axis : {&result.x, &result.y, &result.z}) {
        axis->resize(result.ids.size() + PointBlocks::kPadding);
    }
    return result;
}

}  // namespace knap
