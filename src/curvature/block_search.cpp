#include "curvature/block_search.hpp"

#include <algorithm>
#include <limits>

#include "curvature/block_search_work.hpp"

// Highway compiles this file once for every set of instructions and picks one at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "curvature/block_search.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace knap::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kAnyNumber = std::numeric_limits<std::size_t>::max();
// With more candidates than this times what is wanted, a search begins again with a smaller reach
// or point by point.
constexpr std::size_t kMostCandidates = 32;
// Beyond the reach of the last neighbourhoods: nearly all of the next are within.
constexpr double kReachMargin = 1.05;
constexpr double kNextMargin = 1.25;
constexpr double kGrowth = 1.7;
// A threshold that separates the wanted from the others is found in three steps, seldom in ten.
constexpr int kMostSteps = 12;

const hn::ScalableTag<double> kDoubles;
const hn::ScalableTag<std::uint64_t> kPlaces;

using Doubles = hn::Vec<hn::ScalableTag<double>>;

// first, first + 1, ...: Iota() of a number that is not known beforehand goes through memory.
HWY_INLINE hn::Vec<hn::ScalableTag<std::uint64_t>> places_from(std::size_t first) {
    return hn::Add(hn::Iota(kPlaces, 0), hn::Set(kPlaces, first));
}

// By the arithmetic of squared_distance().
HWY_INLINE Doubles squared_length(Doubles x, Doubles y, Doubles z) {
    return hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
}

// How far coordinates lie outside an interval.
HWY_INLINE Doubles outside(Doubles value, double min, double max) {
    const Doubles below = hn::Sub(hn::Set(kDoubles, min), value);
    const Doubles above = hn::Sub(value, hn::Set(kDoubles, max));
    return hn::Max(hn::Max(below, above), hn::Zero(kDoubles));
}

// Gathers all points whose squared distance to the box is not above `reach`. False if they are
// more than `most`: then only some are gathered.
HWY_ATTR bool gather_candidates(BlockSearchWork& work, const Box& box, double reach,
                                std::size_t most) {
    const std::size_t lanes = hn::Lanes(kDoubles);
    const PointBlocks& points = work.points;
    std::size_t count = 0;
    // Halves of halves: no deeper than the logarithm of their number allows, times the worst split.
    std::vector<std::uint32_t> open{0};
    while (!open.empty()) {
        const std::uint32_t at = open.back();
        open.pop_back();
        const PointBlocks::Node& node = points.nodes[at];
        if (box.squared_distance_to(node.box) > reach) {
            continue;
        }
        if (node.right != 0) {
            open.push_back(at + node.right);
            open.push_back(at + 1);
            continue;
        }
        if (count > most) {
            return false;
        }
        work.reserve(count + node.end - node.begin);
        for (std::size_t i = node.begin; i < node.end; i += lanes) {
            const Doubles x = hn::LoadU(kDoubles, &points.x[i]);
            const Doubles y = hn::LoadU(kDoubles, &points.y[i]);
            const Doubles z = hn::LoadU(kDoubles, &points.z[i]);
            const Doubles squared =
                squared_length(outside(x, box.min.x, box.max.x), outside(y, box.min.y, box.max.y),
                               outside(z, box.min.z, box.max.z));
            const auto near = hn::And(hn::Le(squared, hn::Set(kDoubles, reach)),
                                      hn::FirstN(kDoubles, node.end - i));
            hn::CompressStore(x, near, kDoubles, &work.x[count]);
            hn::CompressStore(y, near, kDoubles, &work.y[count]);
            hn::CompressStore(z, near, kDoubles, &work.z[count]);
            hn::CompressStore(places_from(i), hn::RebindMask(kPlaces, near), kPlaces,
                              &work.places[count]);
            count += hn::CountTrue(kDoubles, near);
        }
    }
    work.candidates = count;
    // What a vector reads past the last candidate compares as false.
    std::fill_n(work.x.begin() + static_cast<std::ptrdiff_t>(count), lanes, kNowhere);
    return true;
}

// Keeps the candidates whose squared distance to p is not above `threshold`; returns how many.
HWY_ATTR std::size_t keep_near(BlockSearchWork& work, const Vec3& p, double threshold) {
    const std::size_t lanes = hn::Lanes(kDoubles);
    const Doubles x = hn::Set(kDoubles, p.x);
    const Doubles y = hn::Set(kDoubles, p.y);
    const Doubles z = hn::Set(kDoubles, p.z);
    const Doubles limit = hn::Set(kDoubles, threshold);
    std::size_t count = 0;
    for (std::size_t i = 0; i < work.candidates; i += lanes) {
        const Doubles squared = squared_length(hn::Sub(hn::LoadU(kDoubles, &work.x[i]), x),
                                               hn::Sub(hn::LoadU(kDoubles, &work.y[i]), y),
                                               hn::Sub(hn::LoadU(kDoubles, &work.z[i]), z));
        const auto near = hn::Le(squared, limit);
        hn::CompressStore(squared, near, kDoubles, &work.near[count]);
        hn::CompressStore(places_from(i), hn::RebindMask(kPlaces, near), kPlaces,
                          &work.which[count]);
        count += hn::CountTrue(kDoubles, near);
    }
    std::fill_n(work.near.begin() + static_cast<std::ptrdiff_t>(count), lanes, kNowhere);
    return count;
}

HWY_ATTR std::size_t count_within(const BlockSearchWork& work, std::size_t near, double threshold) {
    const Doubles limit = hn::Set(kDoubles, threshold);
    std::size_t count = 0;
    for (std::size_t i = 0; i < near; i += hn::Lanes(kDoubles)) {
        count += hn::CountTrue(kDoubles, hn::Le(hn::LoadU(kDoubles, &work.near[i]), limit));
    }
    return count;
}

HWY_ATTR void drop_beyond(BlockSearchWork& work, std::size_t near, double threshold) {
    const Doubles limit = hn::Set(kDoubles, threshold);
    std::size_t count = 0;
    for (std::size_t i = 0; i < near; i += hn::Lanes(kDoubles)) {
        const Doubles squared = hn::LoadU(kDoubles, &work.near[i]);
        const auto which = hn::LoadU(kPlaces, &work.which[i]);
        const auto stays = hn::Le(squared, limit);
        hn::CompressStore(squared, stays, kDoubles, &work.near[count]);
        hn::CompressStore(which, hn::RebindMask(kPlaces, stays), kPlaces, &work.which[count]);
        count += hn::CountTrue(kDoubles, stays);
    }
}

// Writes the first `wanted` of what is near as neighbourhood number `at`.
HWY_ATTR void write_neighbourhood(BlockSearchWork& work, std::size_t at, std::size_t centre) {
    Neighbourhoods& found = work.found;
    const Vec3 p = work.points.position(centre);
    const std::size_t begin = at * found.stride;
    for (std::size_t i = 0; i < work.wanted; ++i) {
        const std::uint64_t which = work.which[i];
        found.x[begin + i] = work.x[which] - p.x;
        found.y[begin + i] = work.y[which] - p.y;
        found.z[begin + i] = work.z[which] - p.z;
    }
    Doubles reach = hn::Zero(kDoubles);
    for (std::size_t i = 0; i < work.wanted; i += hn::Lanes(kDoubles)) {
        const auto valid = hn::FirstN(kDoubles, work.wanted - i);
        reach = hn::Max(reach, hn::IfThenElseZero(valid, hn::LoadU(kDoubles, &work.near[i])));
    }
    found.centres[at] = static_cast<std::uint32_t>(centre);
    found.squared_reaches[at] = work.wanted > work.k ? hn::GetLane(hn::MaxOfLanes(kDoubles, reach))
                                                     : std::numeric_limits<double>::infinity();
}

// Reduces what is near, `count` points within `threshold`, to the wanted nearest ones.
void select(BlockSearchWork& work, std::size_t centre, std::size_t count, double threshold) {
    const auto wanted = static_cast<double>(work.wanted);
    double low = 0;
    double high = threshold;
    std::size_t within_low = 1;
    std::size_t within_high = count;
    // On a surface the number of points grows in proportion to the squared distance.
    for (int step = 0; within_high != work.wanted && step < kMostSteps; ++step) {
        const double part = (wanted - static_cast<double>(within_low)) /
                            static_cast<double>(within_high - within_low);
        const double middle = low + (high - low) * std::clamp(part, 0.02, 0.98);
        const std::size_t within = count_within(work, count, middle);
        if (within >= work.wanted) {
            high = middle;
            within_high = within;
        } else {
            low = middle;
            within_low = within;
        }
    }
    if (within_high == work.wanted) {
        drop_beyond(work, count, high);
    } else {
        settle_ties(work, centre, count);
    }
}

/// Searches the neighbourhoods of some points that lie in a box.
class Search {
  public:
    Search(BlockSearchWork& work, const Box& box)
        : work_(work),
          box_(box),
          most_(kMostCandidates * work.wanted),
          reach_(work.reach),
          guess_(work.reach) {
        // The block before may have reached far.
        if (!gather_candidates(work_, box_, reach_, most_)) {
            reach_ = std::min(reach_, sufficient());
            gather_candidates(work_, box_, reach_, kAnyNumber);
        }
    }

    /// The box is much larger than the neighbourhoods in it.
    bool is_wide() const { return work_.candidates > most_; }

    /// Writes the neighbourhood of a point of the box as the one of number `at`.
    void find(std::size_t centre, std::size_t at) {
        const Vec3 p = work_.points.position(centre);
        double threshold = std::min(guess_, reach_);
        std::size_t near = keep_near(work_, p, threshold);
        while (near < work_.wanted) {
            if (threshold == reach_) {
                widen();
            }
            threshold = reach_;
            near = keep_near(work_, p, threshold);
        }
        select(work_, centre, near, threshold);
        write_neighbourhood(work_, at, centre);
        guess_ = work_.found.squared_reaches[at] * kNextMargin;
        farthest_ = std::max(farthest_, work_.found.squared_reaches[at]);
        work_.reach = farthest_ * kReachMargin;
    }

  private:
    // Never beyond what is certain to do. What is too small to grow goes there at once.
    void widen() {
        const double before = reach_;
        reach_ = reach_ > sufficient() / 256 ? std::min(reach_ * kGrowth, sufficient())
                                             : sufficient() / 16;
        reach_ = reach_ > before ? reach_ : sufficient();
        gather_candidates(work_, box_, reach_, kAnyNumber);
    }

    double sufficient() {
        if (sufficient_ < 0) {
            sufficient_ = sufficient_reach(work_, box_);
        }
        return sufficient_;
    }

    BlockSearchWork& work_;
    Box box_;
    std::size_t most_;
    double reach_;  // squared; all points within it of the box are candidates
    double guess_;  // squared; probably enough for the next point
    double farthest_ = 0;
    double sufficient_ = -1;
};

}  // namespace

void search_block(BlockSearchWork& work, std::size_t block) {
    const PointBlocks::Node& node = work.points.nodes[work.points.blocks[block]];
    const auto asked = work.centres.subspan(node.begin, node.end - node.begin);
    if (std::find(asked.begin(), asked.end(), 1) == asked.end()) {
        work.found.count = 0;
        return;
    }
    std::size_t at = 0;
    Search together(work, node.box);
    const bool one_by_one = together.is_wide();
    for (std::size_t centre = node.begin; centre < node.end; ++centre) {
        if (work.centres[centre] == 0) {
            continue;
        }
        if (one_by_one) {
            const Vec3 p = work.points.position(centre);
            Search(work, {p, p}).find(centre, at);
        } else {
            together.find(centre, at);
        }
        ++at;
    }
    work.found.count = at;
}

}  // namespace knap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace knap {

HWY_EXPORT(search_block);

BlockSearch::BlockSearch(const PointBlocks& points, std::span<const std::uint8_t> centres,
                         std::size_t k)
    : work_(std::make_unique<BlockSearchWork>(points, centres, k)) {}

BlockSearch::~BlockSearch() = default;

const Neighbourhoods& BlockSearch::around(std::size_t block) {
    const PointBlocks::Node& node = work_->points.nodes[work_->points.blocks[block]];
    work_->found.resize(node.end - node.begin, work_->wanted);
    HWY_DYNAMIC_DISPATCH(search_block)(*work_, block);
    return work_->found;
}

}  // namespace knap
#endif
