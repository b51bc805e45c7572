#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <flann/flann.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/threads.hpp"
#include "knap/error.hpp"
#include "knap/source.hpp"
#include "stopwatch.hpp"

// FLANN's exact search for the 30 nearest other points of every point, the yardstick of
// tools/bench.
//
//   knap_bench_flann CLOUD THREADS LEAF
//
// prints: points, build seconds, search seconds (wall), search seconds (CPU), sum of distances.

namespace knap {

namespace {

constexpr std::size_t kFound = 31;       // 30 neighbours and the point itself
constexpr std::size_t kBlock = 1 << 14;  // queries given to FLANN at once, by one thread

using Distance = flann::L2_Simple<float>;
using Index = flann::KDTreeSingleIndex<Distance>;

std::vector<Vec3> read_points(const std::string& path) {
    std::vector<Vec3> points;
    const std::unique_ptr<PointSource> source = open_source(path);
    Chunk chunk;
    while (source->read(chunk, std::size_t{1} << 20)) {
        points.insert(points.end(), chunk.positions.begin(), chunk.positions.end());
    }
    return points;
}

/// Every third bit: the lowest 21 bits of `x` spread over 63.
std::uint64_t spread(std::uint64_t x) {
    x = (x | x << 32) & 0x1f00000000ffffU;
    x = (x | x << 16) & 0x1f0000ff0000ffU;
    x = (x | x << 8) & 0x100f00f00f00f00fU;
    x = (x | x << 4) & 0x10c30c30c30c30c3U;
    return (x | x << 2) & 0x1249249249249249U;
}

/// Coordinates in Morton order, x y z x y z ..., as floats about the centre of their box.
std::vector<float> in_morton_order(const std::vector<Vec3>& points) {
    Box box;
    for (const Vec3& p : points) {
        box.extend(p);
    }
    const Vec3 size = box.size();
    const double cells = 2097151 / std::max({size.x, size.y, size.z, 1e-300});
    std::vector<std::pair<std::uint64_t, std::size_t>> order;
    order.reserve(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3 p = points[i] - box.min;
        order.emplace_back(spread(static_cast<std::uint64_t>(p.x * cells)) |
                               spread(static_cast<std::uint64_t>(p.y * cells)) << 1 |
                               spread(static_cast<std::uint64_t>(p.z * cells)) << 2,
                           i);
    }
    std::sort(order.begin(), order.end());
    std::vector<float> coordinates;
    coordinates.reserve(points.size() * 3);
    for (const auto& [code, i] : order) {
        for (int axis = 0; axis < 3; ++axis) {
            const double centre = box.min[axis] + size[axis] / 2;
            coordinates.push_back(static_cast<float>(points[i][axis] - centre));
        }
    }
    return coordinates;
}

/// Searches a block of points; the sum of its distances keeps the search from being left out.
double search_block(const Index& index, std::vector<float>& coordinates, std::size_t first,
                    std::size_t count) {
    thread_local std::vector<std::size_t> found(kBlock * kFound);
    thread_local std::vector<float> distances(kBlock * kFound);
    const flann::Matrix<float> queries(coordinates.data() + 3 * first, count, 3);
    flann::Matrix<std::size_t> indices(found.data(), count, kFound);
    flann::Matrix<float> squared(distances.data(), count, kFound);
    index.knnSearch(queries, indices, squared, kFound,
                    flann::SearchParams(flann::FLANN_CHECKS_UNLIMITED, 0, true));
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i) {
        sum += static_cast<double>(squared[i][kFound - 1]);
    }
    return sum;
}

void bench(const std::string& path, int threads, int leaf) {
    std::vector<float> coordinates = in_morton_order(read_points(path));
    const std::size_t points = coordinates.size() / 3;
    if (points < kFound) {
        throw ConfigError(
            fmt::format("{}: expected at least {} points, found {}", path, kFound, points));
    }

    auto start = std::chrono::steady_clock::now();
    Index index(flann::Matrix<float>(coordinates.data(), points, 3),
                flann::KDTreeSingleIndexParams(leaf, true));
    index.buildIndex();
    const double build = seconds_since(start);

    const std::size_t blocks = (points + kBlock - 1) / kBlock;
    std::vector<double> sums(blocks);
    start = std::chrono::steady_clock::now();
    const double cpu_before = cpu_seconds();
    run_tasks(blocks, threads, [&](std::size_t block) {
        const std::size_t first = block * kBlock;
        sums[block] = search_block(index, coordinates, first, std::min(kBlock, points - first));
    });
    const double search = seconds_since(start);
    const double cpu = cpu_seconds() - cpu_before;
    double sum = 0;
    for (const double part : sums) {
        sum += part;
    }
    fmt::print("{} {:.3f} {:.3f} {:.3f} {:.9g}\n", points, build, search, cpu, sum);
}

}  // namespace

}  // namespace knap

int main(int argc, char** argv) {
    try {
        if (argc != 4) {
            throw knap::ConfigError("usage: knap_bench_flann CLOUD THREADS LEAF");
        }
        knap::bench(argv[1], std::stoi(argv[2]), std::stoi(argv[3]));
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "knap_bench_flann: error: {}\n", error.what());
        return 1;
    }
}
