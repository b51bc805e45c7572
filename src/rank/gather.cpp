#include "rank/gather.hpp"

#include <algorithm>

#include "base/threads.hpp"

namespace knap {

namespace {

// Coincident points are equally far; the one with the lowest id stands for them.
void drop_coincident(std::vector<FoundNeighbour>& found) {
    std::size_t stay = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
        bool is_new = true;
        for (std::size_t j = stay; is_new && j-- > 0;) {
            if (found[j].squared_distance != found[i].squared_distance) {
                break;
            }
            is_new = found[j].position != found[i].position;
        }
        if (is_new) {
            found[stay++] = found[i];
        }
    }
    found.resize(stay);
}

// Merges what one brick has to offer into what is known.
void merge_found(std::vector<FoundNeighbour>& known, const std::vector<Neighbour>& offered,
                 const CorePoints& core, const Straggler& straggler, std::size_t k) {
    for (const Neighbour& n : offered) {
        if (core.positions[n.index] != straggler.position) {
            known.push_back({n.squared_distance, core.ids[n.index], core.positions[n.index]});
        }
    }
    std::sort(known.begin(), known.end(), [](const FoundNeighbour& a, const FoundNeighbour& b) {
        return a.squared_distance < b.squared_distance ||
               (a.squared_distance == b.squared_distance && a.id < b.id);
    });
    drop_coincident(known);
    known.resize(std::min(known.size(), k));
}

}  // namespace

std::vector<std::vector<FoundNeighbour>> gather(std::span<const Straggler> stragglers,
                                                std::size_t k, const CoreAccess& cores) {
    std::vector<std::vector<FoundNeighbour>> found(stragglers.size());
    const auto bound = [&](std::size_t i) {
        return found[i].size() == k
                   ? std::min(found[i].back().squared_distance, stragglers[i].bound_squared)
                   : stragglers[i].bound_squared;
    };
    std::vector<std::size_t> asking;
    for (std::size_t brick = 0; brick < cores.boxes.size(); ++brick) {
        // squared_distance_to() is monotone like squared_distance(), so no point of the box is
        // nearer, and one that is equally far still counts.
        asking.clear();
        for (std::size_t i = 0; i < stragglers.size(); ++i) {
            if (cores.boxes[brick].squared_distance_to(stragglers[i].position) <= bound(i)) {
                asking.push_back(i);
            }
        }
        if (asking.empty() || cores.boxes[brick].empty()) {
            continue;
        }
        const CorePoints core = cores.load(brick);
        const NeighbourSearch search(core.positions, core.ids);
        constexpr std::size_t kGrain = 64;
        parallel_for(asking.size(), kGrain, [&](std::size_t first, std::size_t last) {
            std::vector<Neighbour> offered;
            for (std::size_t a = first; a < last; ++a) {
                const std::size_t i = asking[a];
                // One more, since a point in the straggler's own place is none.
                search.nearest(stragglers[i].position, stragglers[i].id, k + 1, offered, bound(i));
                merge_found(found[i], offered, core, stragglers[i], k);
            }
        });
    }
    return found;
}

double certain_squared_distance(const Vec3& p, const Box& halo, const Box& archive) {
    double nearest = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
        const double below = p[axis] - halo.min[axis];
        const double above = halo.max[axis] - p[axis];
        // A point outside the halo box gives nothing for certain.
        if (below < 0 || above < 0) {
            return 0;
        }
        if (halo.min[axis] > archive.min[axis]) {
            nearest = std::min(nearest, below * below);
        }
        if (halo.max[axis] < archive.max[axis]) {
            nearest = std::min(nearest, above * above);
        }
    }
    return nearest;
}

}  // namespace knap
