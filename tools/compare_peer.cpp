#include "compare_peer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "knap/error.hpp"
#include "knap/source.hpp"
#include "output/ply_writer.hpp"

namespace knap {

std::vector<Vec3> finite_points(const std::string& path) {
    std::vector<Vec3> points;
    const std::unique_ptr<PointSource> source = open_source(path);
    for (Chunk chunk; source->read(chunk, std::size_t{1} << 20);) {
        std::copy_if(chunk.positions.begin(), chunk.positions.end(), std::back_inserter(points),
                     [](const Vec3& p) { return is_finite(p); });
    }
    return points;
}

double search_parameter(const std::function<Simplified(double)>& simplify, double count, double low,
                        double high) {
    constexpr int kSteps = 22;
    constexpr double kNear = 0.003;
    double best = low;
    double best_miss = HUGE_VAL;
    for (int step = 0; step < kSteps && best_miss > kNear; ++step) {
        const double middle = (low + high) / 2;
        const double found = static_cast<double>(simplify(middle).points.size());
        if (std::abs(found / count - 1) < best_miss) {
            best_miss = std::abs(found / count - 1);
            best = middle;
        }
        (found > count ? low : high) = middle;
    }
    return best;
}

double largest_cell(const std::vector<Vec3>& points, double count) {
    Box box;
    for (const Vec3& p : points) {
        box.extend(p);
    }
    const double longest =
        std::max({box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z});
    // A surface with as many cells as points are wanted, or a few times that.
    return 4 * longest / std::sqrt(count);
}

int run_peer(int argc, char** argv, const std::string& program,
             const std::function<Way(const std::string& name, const std::string& cloud)>& make) {
    try {
        const std::vector<std::string> words(argv + 1, argv + argc);
        if (words.size() == 4 && words[0] == "find") {
            fmt::print("{:.17g}\n", make(words[1], words[2]).parameter_for(std::stod(words[3])));
        } else if (words.size() == 5 && words[0] == "run") {
            const Simplified kept = make(words[1], words[2]).simplify(std::stod(words[3]));
            PlyWriter writer(words[4], kept.points.size(), PlyWriter::Precision::kDouble, {});
            writer.append(kept.points);
            writer.finish();
            fmt::print("{} {:.3f}\n", kept.points.size(), kept.seconds);
        } else {
            throw ConfigError("expected find WAY CLOUD COUNT, or run WAY CLOUD PARAMETER OUT.ply");
        }
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}: error: {}\n", program, error.what());
        return 1;
    }
}

}  // namespace knap
