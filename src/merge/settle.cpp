#include "merge/settle.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "base/threads.hpp"
#include "merge/coverage.hpp"

namespace knap {

namespace {

// About what a cache of the second level holds of kept points.
constexpr std::size_t kLeafPoints = std::size_t{1} << 16;
// Where halves leave more than this share open, a walk of the whole decides little more.
constexpr double kWorthAnotherWalk = 0.5;

using Places = std::vector<std::uint32_t>;

Settled join(const Settled& a, const Settled& b) {
    Settled joined;
    const auto merge = [](const Places& from, const Places& and_from, Places& into) {
        into.reserve(from.size() + and_from.size());
        std::merge(from.begin(), from.end(), and_from.begin(), and_from.end(),
                   std::back_inserter(into));
    };
    merge(a.kept, b.kept, joined.kept);
    merge(a.open, b.open, joined.open);
    return joined;
}

class Settler {
  public:
    explicit Settler(std::span<const RangedPoint> points) : points_(points) {}

    Settled settle(Places places, const std::vector<Box>& outside) const {
        const std::size_t size = places.size();
        if (size <= kLeafPoints) {
            return walk(places, outside);
        }
        Settled settled = settle_halves(std::move(places), outside);
        const bool worth = static_cast<double>(settled.open.size()) <
                           kWorthAnotherWalk * static_cast<double>(size);
        if (!outside.empty() && !worth) {
            return settled;
        }
        Settled rest = walk(settled.open, outside);
        settled.open.clear();
        return join(settled, rest);
    }

  private:
    Settled settle_halves(Places places, const std::vector<Box>& outside) const {
        const auto [left, right] = halve(std::move(places));
        const auto settle_beside = [&](const Places& half, const Places& other) {
            std::vector<Box> beside = outside;
            beside.push_back(box_of(other));
            return settle(half, beside);
        };
        Settled of_left;
        Settled of_right;
        parallel_both([&, &left = left, &right = right] { of_left = settle_beside(left, right); },
                      [&, &left = left, &right = right] { of_right = settle_beside(right, left); });
        return join(of_left, of_right);
    }

    // Across the longest axis, about in the middle.
    std::pair<Places, Places> halve(Places places) const {
        const Box box = box_of(places);
        const Vec3 size = box.size();
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        std::array<double, 255> sample{};
        for (std::size_t i = 0; i < sample.size(); ++i) {
            sample[i] = points_[places[i * places.size() / sample.size()]].position[axis];
        }
        const std::size_t middle = sample.size() / 2;
        std::nth_element(sample.begin(), sample.begin() + middle, sample.end());
        // Neither half is empty, whatever the sample: one holds the lowest, the other the highest.
        const double face = sample[middle] > box.min[axis] ? sample[middle] : box.max[axis];
        std::pair<Places, Places> halves;
        halves.first.reserve(places.size());
        for (const std::uint32_t place : places) {
            (points_[place].position[axis] < face ? halves.first : halves.second).push_back(place);
        }
        return halves;
    }

    Box box_of(const Places& places) const {
        Box box;
        for (const std::uint32_t place : places) {
            box.extend(points_[place].position);
        }
        return box;
    }

    Settled walk(const Places& places, const std::vector<Box>& outside) const {
        // Copied together first: the walk's own reads stay within the cache.
        std::vector<RangedPoint> near;
        near.reserve(places.size());
        Box box;
        for (const std::uint32_t place : places) {
            near.push_back(points_[place]);
            box.extend(near.back().position);
        }
        Coverage kept(box);
        Coverage open(box);
        Settled settled;
        for (std::size_t i = 0; i < near.size(); ++i) {
            const RangedPoint& p = near[i];
            if (kept.marks(p.position)) {
                continue;
            }
            if (open.marks(p.position) || touches(p, outside)) {
                open.add(p.position, p.range);
                settled.open.push_back(places[i]);
            } else {
                kept.add(p.position, p.range);
                settled.kept.push_back(places[i]);
            }
        }
        return settled;
    }

    // squared_distance_to() is monotone like squared_distance(), so no point of a box is nearer.
    static bool touches(const RangedPoint& p, const std::vector<Box>& outside) {
        return std::any_of(outside.begin(), outside.end(), [&](const Box& box) {
            return box.squared_distance_to(p.position) <= p.range * p.range;
        });
    }

    std::span<const RangedPoint> points_;
};

}  // namespace

Settled settle(std::span<const RangedPoint> points, std::span<const Box> outside) {
    Places all(points.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
        all[i] = static_cast<std::uint32_t>(i);
    }
    return Settler(points).settle(std::move(all), {outside.begin(), outside.end()});
}

}  // namespace knap
