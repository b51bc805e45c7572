#include "support/reference.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
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

// Section 4: walk the order, keep what is not marked, mark by brute force.
std::vector<std::size_t> walk(const Counted& cloud, const std::vector<double>& h, double mean,
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
        for (std::size_t q = 0; q < marked.size(); ++q) {
            const double squared = squared_distance(cloud.positions[p], cloud.positions[q]);
            marked[q] = static_cast<char>(marked[q] | static_cast<char>(squared <= r * r));
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

    const CurvatureEstimator estimator(params, result.spacing);
    std::vector<double> h(n);
    for (std::size_t i = 0; i < n; ++i) {
        std::vector<Vec3> neighbourhood{cloud.positions[i]};
        for (const Candidate& neighbour : nearest[i]) {
            neighbourhood.push_back(cloud.positions[neighbour.index]);
        }
        h[i] = estimator.mean_curvature(neighbourhood);
    }
    if (n > 0) {
        result.mean_curvature = exact_sum(h) / static_cast<double>(n);
    }
    RangeParams with_alpha = range;
    if (range.tolerance > 0) {
        with_alpha.alpha = std::sqrt(2 * range.tolerance / result.mean_curvature);
    }
    std::vector<std::size_t> kept = walk(cloud, h, result.mean_curvature, with_alpha);
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

double curvature(std::span<const Vec3> neighbourhood, const CurvatureParams& params,
                 double spacing) {
    const auto n = static_cast<Eigen::Index>(neighbourhood.size());
    Eigen::MatrixXd points(n, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
        const Vec3& p = neighbourhood[static_cast<std::size_t>(i)];
        points.row(i) << p.x, p.y, p.z;
    }
    const Eigen::MatrixXd centred = points.rowwise() - points.colwise().mean();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(centred.transpose() * centred);
    const Eigen::Matrix3d frame = solver.eigenvectors();  // columns z, y, x
    const Eigen::MatrixXd local = (points.rowwise() - points.row(0)) * frame;

    const int samples = params.samples;
    const double h = params.step * spacing;
    const double half_period = samples * h / 2;
    const auto kappa = [&](int along, int across) {
        std::vector<double> g;
        for (int l = 0; l < samples; ++l) {
            const double u = (l - samples / 2) * h;
            std::array<double, 4> best;
            best.fill(std::numeric_limits<double>::infinity());
            std::array<double, 4> height{};
            for (Eigen::Index i = 0; i < n; ++i) {
                const double a = local(i, along);
                const double b = local(i, across);
                const double z = local(i, 0);
                const std::size_t quadrant = (a >= u ? 1U : 0U) + (b >= 0 ? 2U : 0U);
                const double distance = std::sqrt((a - u) * (a - u) + b * b + z * z);
                if (distance < best[quadrant]) {
                    best[quadrant] = distance;
                    height[quadrant] = z;
                }
            }
            double weighted = 0;
            double total = 0;
            bool exact = false;
            for (std::size_t q = 0; q < 4 && !exact; ++q) {
                if (best[q] == 0) {
                    weighted = height[q];
                    total = 1;
                    exact = true;
                } else if (std::isfinite(best[q])) {
                    weighted += height[q] / best[q];
                    total += 1 / best[q];
                }
            }
            g.push_back(weighted / total);
        }
        double first = 0;
        double second = 0;
        for (int order = 1; order < samples / 2; ++order) {
            double a = 0;
            double b = 0;
            for (int l = 0; l < samples; ++l) {
                const double angle = 2 * std::numbers::pi * order * (l - samples / 2) / samples;
                a += 2.0 / samples * g[static_cast<std::size_t>(l)] * std::cos(angle);
                b += 2.0 / samples * g[static_cast<std::size_t>(l)] * std::sin(angle);
            }
            first += std::numbers::pi / half_period * order * b;
            second -= std::pow(std::numbers::pi / half_period, 2) * order * order * a;
        }
        return second / std::pow(1 + first * first, 1.5);
    };
    return std::abs((kappa(2, 1) + kappa(1, 2)) / 2);
}

double exact_sum(std::span<const double> values) {
    // Partial sums that do not overlap, smallest first.
    std::vector<double> partials;
    for (double x : values) {
        std::size_t used = 0;
        for (double y : partials) {
            if (std::abs(x) < std::abs(y)) {
                std::swap(x, y);
            }
            const double high = x + y;
            const double low = y - (high - x);
            if (low != 0) {
                partials[used++] = low;
            }
            x = high;
        }
        partials.resize(used);
        partials.push_back(x);
    }
    if (partials.empty()) {
        return 0;
    }
    double sum = partials.back();
    partials.pop_back();
    double low = 0;
    while (!partials.empty()) {
        const double x = sum;
        const double y = partials.back();
        partials.pop_back();
        sum = x + y;
        low = y - (sum - x);
        if (low != 0) {
            break;
        }
    }
    // A tie that the partials below decide.
    if (!partials.empty() &&
        ((low < 0 && partials.back() < 0) || (low > 0 && partials.back() > 0))) {
        const double twice = low * 2;
        const double up = sum + twice;
        if (up - sum == twice) {
            sum = up;
        }
    }
    return sum;
}

}  // namespace knap::reference
