#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "base/threads.hpp"
#include "curvature/block_search.hpp"
#include "curvature/point_blocks.hpp"
#include "knap/source.hpp"
#include "stopwatch.hpp"

// knap's own search for the 30 nearest other points of every point, alone, for tools/bench.
//
//   knap_bench_neighbours CLOUD THREADS
//
// prints: points, seconds to make the blocks, seconds to search them (wall), both (CPU), sum of the
// squared distances to the 30th.

namespace knap {

namespace {

constexpr std::size_t kNeighbours = 30;
constexpr std::size_t kGrainBlocks = 64;

std::vector<TaggedPoint> read_points(const std::string& path) {
    std::vector<TaggedPoint> points;
    const std::unique_ptr<PointSource> source = open_source(path);
    Chunk chunk;
    while (source->read(chunk, std::size_t{1} << 20)) {
        for (const Vec3& p : chunk.positions) {
            points.emplace_back(p, points.size(), true);
        }
    }
    return points;
}

void bench(const std::string& path, int threads) {
    const ThreadLimit limit(threads);
    std::vector<TaggedPoint> points = read_points(path);
    const double cpu_before = cpu_seconds();
    auto start = std::chrono::steady_clock::now();
    const PointBlocks blocks = make_blocks(std::move(points));
    const double build = seconds_since(start);

    start = std::chrono::steady_clock::now();
    double sum = 0;
    std::mutex mutex;
    parallel_for(blocks.blocks.size(), kGrainBlocks, [&](std::size_t first, std::size_t last) {
        BlockSearch search(blocks, blocks.is_core, kNeighbours);
        double part = 0;
        for (std::size_t block = first; block < last; ++block) {
            const Neighbourhoods& found = search.around(block);
            for (std::size_t i = 0; i < found.count; ++i) {
                part += found.squared_reaches[i];
            }
        }
        const std::scoped_lock lock(mutex);
        sum += part;
    });
    const double search = seconds_since(start);
    fmt::print("{} {:.3f} {:.3f} {:.3f} {:.9g}\n", blocks.size(), build, search,
               cpu_seconds() - cpu_before, sum);
}

}  // namespace

}  // namespace knap

int main(int argc, char** argv) {
    try {
        if (argc != 3) {
            fmt::print(stderr, "usage: knap_bench_neighbours CLOUD THREADS\n");
            return 1;
        }
        knap::bench(argv[1], std::stoi(argv[2]));
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "knap_bench_neighbours: error: {}\n", error.what());
        return 1;
    }
}
