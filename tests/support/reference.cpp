#include "support/reference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>

#include "base/threads.hpp"
#include "curvature/estimator.hpp"
#include "surface/fan_surface.hpp"

namespace knap::reference {

namespace {

struct Candidate {
    double squared;
    PointId id;
    std::size_t index;
    bool operator<(const Candidate& other) const {
        return std::tie(squared, id) < std::tie(other.squared, other.id);
    }
};

struct Counted {
    std::vector<Vec3> positions;
    std::vector<PointId> ids;
};

// Section 1: finite points, the lowest id of each set of coincident ones.
Counted counted_points(std::span<const Vec3> points, Result& result) {
    std::map<std::array<double, 3>, PointId> first;
    Counted counted;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3& p = points[i];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
            ++result.rejected;
        } else if (!first.emplace(std::array{p.x + 0.0, p.y + 0.0, p.z + 0.0}, i).second) {
            ++result.merged;
        } else {
            counted.positions.push_back(p);
            counted.ids.push_back(i);
        }
    }
    return counted;
}

// The k nearest others by (distance, id) of every point.
std::vector<std::vector<Candidate>> all_nearest(const Counted& cloud, std::size_t k) {
    const std::size_t n = cloud.ids.size();
    std::vector<double> x(n);
    std::vector<double> y(n);
    std::vector<double> z(n);
    for (std::size_t i = 0; i < n; ++i) {
        x[i] = cloud.positions[i].x;
        y[i] = cloud.positions[i].y;
        z[i] = cloud.positions[i].z;
    }
    std::vector<std::vector<Candidate>> nearest(n);
    parallel_for(n, 64, [&](std::size_t begin, std::size_t end) {
        constexpr std::size_t kBlock = 1024;
        std::array<double, kBlock> squared{};
        for (std::size_t i = begin; i < end; ++i) {
            // A heap of the best so far; its worst is the limit for the rest.
            std::vector<Candidate>& best = nearest[i];
            double limit = std::numeric_limits<double>::infinity();
            for (std::size_t first = 0; first < n; first += kBlock) {
                const std::size_t count = std::min(kBlock, n - first);
                for (std::size_t j = 0; j < count; ++j) {
                    const double dx = x[i] - x[first + j];
                    const double dy = y[i] - y[first + j];
                    const double dz = z[i] - z[first + j];
                    squared[j] = dx * dx + dy * dy + dz * dz;
                }
                for (std::size_t j = 0; j < count; ++j) {
                    if (squared[j] > limit || first + j == i) {
                        continue;
                    }
                    best.push_back({squared[j], cloud.ids[first + j], first + j});
                    std::push_heap(best.begin(), best.end());
                    if (best.size() > k) {
                        std::pop_heap(best.begin(), best.end());
                        best.pop_back();
                    }
                    if (best.size() == k) {
                        limit = best.front().squared;
                    }
                }
            }
            std::sort(best.begin(), best.end());
        }
    });
    return nearest;
}

std::uint64_t splitmix64(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
    x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
    return x ^ (x >> 31);
}

double range_at(double h, double mean, const RangeParams& range) {
    double r = std::numeric_limits<double>::infinity();
    if (h != 0) {
        r = range.law == RangeLawKind::kChord ? range.alpha * std::sqrt(mean / h)
                                              : range.alpha * mean / h;
    }
    return std::min(std::max(r, range.alpha * range.min_factor), range.alpha * range.max_factor);
}

// Section 5: is q, within the reach of p, in the region of p? Written down from the text, with the
// library's rounded frame.
bool in_region(const Vec3& p, const PackedFrame& packed, double h, double r,
               const RangeParams& range, const Vec3& q) {
    const LocalFrame frame = packed.frame();
    const auto along = [&](const Vec3& axis) {
        return (q.x - p.x) * axis.x + (q.y - p.y) * axis.y + (q.z - p.z) * axis.z;
    };
    const double u = along(frame.steepest);
    const double v = along(frame.flattest);
    const double w = along(frame.normal);
    const double f = std::min(frame.flatness, range.aspect);
    const bool ellipsoid = f == 1 || f * (u * u) + v * v / f + w * w <= r * r;
    const double height = w - h * (u * u + v * v) / 2;
    return ellipsoid && (range.slab == 0 || std::abs(height) <= range.slab * r);
}

// Section 4: walk the order, keep what is not marked, mark by brute force.
std::vector<std::size_t> walk(const Counted& cloud, const std::vector<double>& h,
                              const std::vector<PackedFrame>& frames, double mean,
                              const RangeParams& range) {
    std::vector<std::size_t> order(h.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        if (h[a] != h[b]) {
            return h[a] > h[b];
        }
        return std::pair(splitmix64(cloud.ids[a]), cloud.ids[a]) <
               std::pair(splitmix64(cloud.ids[b]), cloud.ids[b]);
    });
    std::vector<char> marked(h.size());
    std::vector<std::size_t> kept;
    for (const std::size_t p : order) {
        if (marked[p] != 0) {
            continue;
        }
        kept.push_back(p);
        const double r = range_at(h[p], mean, range);
        const bool is_ball = frames[p].is_none() || (range.slab == 0 && range.aspect == 1);
        const double stretch =
            is_ball ? 1 : std::sqrt(std::min(frames[p].frame().flatness, range.aspect));
        const double reach = r * stretch;
        for (std::size_t q = 0; q < marked.size(); ++q) {
            const double squared = squared_distance(cloud.positions[p], cloud.positions[q]);
            if (squared <= reach * reach &&
                (is_ball ||
                 in_region(cloud.positions[p], frames[p], h[p], r, range, cloud.positions[q]))) {
                marked[q] = 1;
            }
        }
    }
    return kept;
}

// Points that are not kept and farther than a limit from the surface through the kept ones, the
// farthest first. All kept points at once.
std::vector<std::pair<double, std::size_t>> farther(const Counted& cloud,
                                                    const std::vector<char>& kept, double farthest,
                                                    double limit) {
    std::vector<Vec3> positions;
    std::vector<PointId> ids;
    for (std::size_t i = 0; i < kept.size(); ++i) {
        if (kept[i] != 0) {
            positions.push_back(cloud.positions[i]);
            ids.push_back(cloud.ids[i]);
        }
    }
    const FanSurface surface(positions, ids, farthest);
    std::vector<std::pair<double, std::size_t>> found;
    for (std::size_t i = 0; i < kept.size(); ++i) {
        const double distance = surface.nearest(cloud.positions[i]).distance;
        if (kept[i] == 0 && distance > limit) {
            found.emplace_back(distance, i);
        }
    }
    std::sort(found.begin(), found.end(), [&](const auto& a, const auto& b) {
        const auto key = [&](const auto& of) {
            return std::tuple(-of.first, splitmix64(cloud.ids[of.second]), cloud.ids[of.second]);
        };
        return key(a) < key(b);
    });
    return found;
}

// Section 6. The sample is all points: there are few.
void repair(const Counted& cloud, std::vector<std::size_t>& indices, const RangeParams& range,
            std::size_t wanted, double diagonal) {
    std::vector<char> kept(cloud.ids.size());
    for (const std::size_t i : indices) {
        kept[i] = 1;
    }
    const double farthest = 8 * std::min(range.alpha * range.max_factor, diagonal);
    if (!(farthest > 0)) {
        return;
    }
    const bool bounded = range.tolerance > 0;
    double limit = range.tolerance;
    for (int pass = 0; pass < (bounded ? 16 : 3) && (bounded || indices.size() < wanted); ++pass) {
        if (!bounded && pass == 0) {
            const auto n = static_cast<double>(kept.size());
            const auto above = static_cast<std::size_t>(
                std::min(0.3, 12 * static_cast<double>(wanted - indices.size()) / n) * n);
            const auto all = farther(cloud, kept, farthest, 0);
            limit = above < all.size() ? all[above].first : 0;
        }
        std::vector<char> suspect(kept.size());
        for (const auto& [distance, i] : farther(cloud, kept, farthest, limit)) {
            suspect[i] = 1;
        }
        for (int round = 0; round < 4; ++round) {
            const std::size_t most = bounded
                                         ? kept.size()
                                         : (wanted > indices.size() ? wanted - indices.size() : 0) /
                                               static_cast<std::size_t>(4 - round);
            std::vector<std::size_t> walked;
            std::vector<char> still(kept.size());
            for (const auto& [distance, i] : farther(cloud, kept, farthest, limit)) {
                const double apart = 0.5 * range.alpha;
                still[i] = suspect[i];
                if (suspect[i] != 0 && walked.size() < most &&
                    std::none_of(walked.begin(), walked.end(), [&](std::size_t other) {
                        return squared_distance(cloud.positions[other], cloud.positions[i]) <=
                               apart * apart;
                    })) {
                    walked.push_back(i);
                }
            }
            suspect = still;
            for (const std::size_t i : walked) {
                kept[i] = 1;
                indices.push_back(i);
            }
        }
        limit = bounded ? limit : limit / 4;
    }
}

}  // namespace

Result simplify(std::span<const Vec3> points, const CurvatureParams& params,
                const RangeParams& range) {
    Result result;
    const Counted cloud = counted_points(points, result);
    const std::size_t n = cloud.ids.size();
    const auto nearest = all_nearest(cloud, static_cast<std::size_t>(params.neighbours));

    std::vector<double> distances;
    for (const auto& neighbours : nearest) {
        if (!neighbours.empty()) {
            distances.push_back(std::sqrt(neighbours.front().squared));
        }
    }
    if (!distances.empty()) {
        result.spacing = exact_sum(distances) / static_cast<double>(distances.size());
    }

    const CurvatureEstimator estimator(params, result.spacing, true);
    std::vector<double> h(n);
    std::vector<PackedFrame> frames(n);
    for (std::size_t i = 0; i < n; ++i) {
        std::vector<Vec3> neighbourhood{cloud.positions[i]};
        for (const Candidate& neighbour : nearest[i]) {
            neighbourhood.push_back(cloud.positions[neighbour.index]);
        }
        const CurvatureEstimator::Estimate found = estimator.estimate(neighbourhood);
        h[i] = found.curvature;
        frames[i] = found.frame;
    }
    if (n > 0) {
        result.mean_curvature = exact_sum(h) / static_cast<double>(n);
    }
    RangeParams with_alpha = range;
    if (range.tolerance > 0) {
        with_alpha.alpha = std::sqrt(2 * range.tolerance / result.mean_curvature);
    }
    std::vector<std::size_t> kept = walk(cloud, h, frames, result.mean_curvature, with_alpha);
    if (range.repair > 0 || range.tolerance > 0) {
        Box box;
        for (const Vec3& p : cloud.positions) {
            box.extend(p);
        }
        repair(cloud, kept, with_alpha,
               static_cast<std::size_t>(
                   std::floor(static_cast<double>(kept.size()) / (1 - range.repair))),
               box.empty() ? 0 : box.diagonal());
    }
    for (const std::size_t p : kept) {
        result.kept.push_back(cloud.ids[p]);
    }
    std::sort(result.kept.begin(), result.kept.end());
    result.represented = n - result.kept.size();
    return result;
}

}  // namespace knap::reference
