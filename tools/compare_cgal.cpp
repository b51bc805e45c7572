#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/grid_simplify_point_set.h>
#include <CGAL/hierarchy_simplify_point_set.h>
#include <CGAL/random_simplify_point_set.h>
#include <CGAL/wlop_simplify_and_regularize_point_set.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "emit/ply_writer.hpp"
#include "knap/error.hpp"
#include "knap/source.hpp"
#include "stopwatch.hpp"

// CGAL's ways to simplify a point set, peers for tools/compare. CGAL is under the GPL, and so is
// this program; knap itself uses none of it.
//
//   knap_compare_cgal random|grid|hierarchy|wlop CLOUD COUNT OUT.ply
//
// writes about COUNT points and prints: points kept, seconds (wall, of the last call alone, without
// reading, writing, or looking for the parameter that gives COUNT).

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Points = std::vector<Kernel::Point_3>;

Points read_points(const std::string& path) {
    Points points;
    const std::unique_ptr<knap::PointSource> source = knap::open_source(path);
    for (knap::Chunk chunk; source->read(chunk, std::size_t{1} << 20);) {
        for (const knap::Vec3& p : chunk.positions) {
            if (knap::is_finite(p)) {
                points.emplace_back(p.x, p.y, p.z);
            }
        }
    }
    return points;
}

/// What a method keeps with a parameter of which more means fewer points.
using Method = std::function<Points(const Points& all, double parameter)>;

Points by_random(const Points& all, double percentage) {
    Points points = all;
    points.erase(CGAL::random_simplify_point_set(points, percentage), points.end());
    return points;
}

Points by_grid(const Points& all, double cell) {
    Points points = all;
    points.erase(CGAL::grid_simplify_point_set(points, cell), points.end());
    return points;
}

Points by_hierarchy(const Points& all, double size) {
    Points points = all;
    const auto most = static_cast<unsigned int>(std::lround(size));
    points.erase(
        CGAL::hierarchy_simplify_point_set(points, CGAL::parameters::size(std::max(most, 2U))),
        points.end());
    return points;
}

Points by_wlop(const Points& all, double percentage) {
    Points points = all;
    Points result;
    CGAL::wlop_simplify_and_regularize_point_set<CGAL::Sequential_tag>(
        points, std::back_inserter(result), CGAL::parameters::select_percentage(100 - percentage));
    return result;
}

/// Halves the interval of the parameter until the count is met, or it cannot be met better.
double parameter_for(const Method& method, const Points& all, double count, double low,
                     double high) {
    constexpr int kSteps = 22;
    constexpr double kNear = 0.003;
    double best = low;
    double best_miss = HUGE_VAL;
    for (int step = 0; step < kSteps && best_miss > kNear; ++step) {
        const double middle = (low + high) / 2;
        const double found = static_cast<double>(method(all, middle).size());
        if (std::abs(found / count - 1) < best_miss) {
            best_miss = std::abs(found / count - 1);
            best = middle;
        }
        (found > count ? low : high) = middle;
    }
    return best;
}

void compare(const std::string& name, const std::string& cloud, double count,
             const std::string& out) {
    const Points all = read_points(cloud);
    const double percentage = 100 - 100 * count / static_cast<double>(all.size());
    Method method = by_random;
    double parameter = percentage;
    if (name == "wlop") {
        method = by_wlop;
    } else if (name == "grid") {
        method = by_grid;
        const CGAL::Bbox_3 box = CGAL::bbox_3(all.begin(), all.end());
        const double longest = std::max({box.x_span(), box.y_span(), box.z_span()});
        // A surface with as many cells as points are wanted, or a few times that.
        parameter = parameter_for(method, all, count, 0, 4 * longest / std::sqrt(count));
    } else if (name == "hierarchy") {
        method = by_hierarchy;
        parameter =
            parameter_for(method, all, count, 2, static_cast<double>(all.size()) / count * 8);
    } else if (name != "random") {
        throw knap::ConfigError("expected random, grid, hierarchy or wlop");
    }
    const auto start = std::chrono::steady_clock::now();
    const Points kept = method(all, parameter);
    const double seconds = knap::seconds_since(start);
    std::vector<knap::Vec3> positions;
    positions.reserve(kept.size());
    for (const Kernel::Point_3& p : kept) {
        positions.push_back({p.x(), p.y(), p.z()});
    }
    knap::PlyWriter writer(out, positions.size(), knap::PlyWriter::Precision::kDouble, {});
    writer.append(positions);
    writer.finish();
    fmt::print("{} {:.3f}\n", kept.size(), seconds);
}

}  // namespace

int main(int argc, char** argv) {
    try {
        if (argc != 5) {
            throw knap::ConfigError("expected random|grid|hierarchy|wlop CLOUD COUNT OUT.ply");
        }
        compare(argv[1], argv[2], std::stod(argv[3]), argv[4]);
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "knap_compare_cgal: error: {}\n", error.what());
        return 1;
    }
}
