#include <CGAL/Simple_cartesian.h>
#include <CGAL/hierarchy_simplify_point_set.h>
#include <fmt/format.h>

#include <chrono>
#include <string>
#include <vector>

#include "knap/source.hpp"
#include "stopwatch.hpp"

// CGAL's hierarchical simplification, a peer for tools/bench --peers: clusters of at most SIZE
// points, which decides how many points it keeps; the largest variation is its default. CGAL is
// under the GPL, and so is this program once it is linked; knap itself uses none of it.
//
//   knap_bench_cgal CLOUD SIZE
//
// prints: points, points kept, seconds (wall, without reading the cloud).

namespace {

using Kernel = CGAL::Simple_cartesian<double>;

std::vector<Kernel::Point_3> read_points(const std::string& path) {
    std::vector<Kernel::Point_3> points;
    const std::unique_ptr<knap::PointSource> source = knap::open_source(path);
    knap::Chunk chunk;
    while (source->read(chunk, std::size_t{1} << 20)) {
        for (const knap::Vec3& p : chunk.positions) {
            points.emplace_back(p.x, p.y, p.z);
        }
    }
    return points;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        if (argc != 3) {
            fmt::print(stderr, "usage: knap_bench_cgal CLOUD SIZE\n");
            return 1;
        }
        std::vector<Kernel::Point_3> points = read_points(argv[1]);
        const std::size_t before = points.size();
        const auto start = std::chrono::steady_clock::now();
        const auto kept =
            CGAL::hierarchy_simplify_point_set(points, CGAL::parameters::size(std::stoul(argv[2])));
        const double seconds = knap::seconds_since(start);
        fmt::print("{} {} {:.3f}\n", before, kept - points.begin(), seconds);
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "knap_bench_cgal: error: {}\n", error.what());
        return 1;
    }
}
