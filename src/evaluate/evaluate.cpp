#include "evaluate/evaluate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/extent.hpp"
#include "input/stream.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "knap/source.hpp"

namespace knap {

namespace {

constexpr std::uint64_t kRangePoints = std::uint64_t{1} << 18;
constexpr std::size_t kChunkPoints = std::size_t{1} << 14;

std::vector<Vec3> read_all(const std::filesystem::path& path) {
    std::vector<Vec3> points;
    if (std::filesystem::is_directory(path)) {
        const Archive archive(path);
        for (std::size_t tile = 0; tile < archive.manifest().tiles.size(); ++tile) {
            const std::vector<Vec3> some = archive.read_tile(tile);
            points.insert(points.end(), some.begin(), some.end());
        }
        return points;
    }
    const std::unique_ptr<PointSource> source = open_source(path);
    for (Chunk chunk; source->read(chunk, kChunkPoints);) {
        points.insert(points.end(), chunk.positions.begin(), chunk.positions.end());
    }
    return points;
}

}  // namespace

std::vector<Vec3> simplified_points(const std::filesystem::path& path) {
    std::vector<Vec3> points = read_all(path);
    std::erase_if(points, [](const Vec3& p) { return !is_finite(p); });
    Box box;
    for (const Vec3& p : points) {
        box.extend(p);
    }
    check_extent(box);
    std::sort(points.begin(), points.end(), [](const Vec3& a, const Vec3& b) {
        return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
    });
    points.erase(std::unique(points.begin(), points.end()), points.end());
    return points;
}

Evaluation evaluate(const std::vector<std::filesystem::path>& originals, const Surface& surface,
                    int threads, const std::function<void(std::uint64_t)>& advance) {
    std::vector<SourceInfo> infos;
    infos.reserve(originals.size());
    for (const std::filesystem::path& path : originals) {
        infos.push_back(open_source(path)->info());
    }
    struct Worker {
        DeviationSum sum;
        Box box;
    };
    std::vector<Worker> workers(static_cast<std::size_t>(threads));
    stream_ranges(infos, cut_into_ranges(infos, kRangePoints), threads, kChunkPoints,
                  [&](std::size_t slot, std::size_t, const Chunk& chunk) {
                      Worker& worker = workers[slot];
                      for (const Vec3& p : chunk.positions) {
                          if (is_finite(p)) {
                              worker.sum.add(surface.nearest(p));
                              worker.box.extend(p);
                          }
                      }
                      advance(chunk.positions.size());
                  });
    for (std::size_t i = 1; i < workers.size(); ++i) {
        workers[0].sum.add(workers[i].sum);
        workers[0].box.extend(workers[i].box);
    }
    const Box& box = workers[0].box;
    check_extent(box);
    if (!(box.diagonal() > 0)) {
        throw InputError(
            fmt::format("{}{}: expected points that are not all in one place, found "
                        "none",
                        originals.front().string(), originals.size() > 1 ? " and others" : ""));
    }
    return {workers[0].sum.result(surface.area()), box};
}

std::string describe_header() {
    return fmt::format("{:<10} {:>13} {:>10} {:>10} {:>10} {:>10}", "surface", "points", "mean",
                       "rms", "p99", "max");
}

std::string describe(const std::string& name, const Evaluation& evaluation) {
    const Deviation& found = evaluation.deviation;
    const double diagonal = evaluation.box.empty() ? 1 : evaluation.box.diagonal();
    return fmt::format(
        "{:<10} {:>13} {:>10.3e} {:>10.3e} {:>10.3e} {:>10.3e}{}", name, found.points,
        found.mean / diagonal, found.rms / diagonal, found.p99 / diagonal, found.max / diagonal,
        std::isfinite(found.facet_d) ? fmt::format("  D {:.4e}", found.facet_d) : "");
}

}  // namespace knap
