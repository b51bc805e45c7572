#include "report/relief.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "base/threads.hpp"

namespace knap {

namespace {

constexpr std::size_t kRows = 16;

constexpr std::array<std::array<int, 2>, 8> kDirections{
    {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
// Of them, those in which a hole may be open.
constexpr int kOpen = 1;

/// What closes a hole: the mean depth of the surface round it, and the pixel where it is nearest.
struct Patch {
    float depth = Relief::kNothing;
    std::size_t pixel = 0;
};

/// The first pixel of the surface that goes on before a hole: how far away, and which.
struct Rim {
    int distance = 0;
    std::size_t pixel = 0;
};

std::optional<Rim> rim_of(const Relief& relief, int x, int y, const std::array<int, 2>& direction,
                          int reach, float limit) {
    for (int distance = 1; distance <= reach; ++distance) {
        const int u = x + direction[0] * distance;
        const int v = y + direction[1] * distance;
        if (u < 0 || u >= relief.width || v < 0 || v >= relief.height) {
            return std::nullopt;
        }
        if (relief.depth[relief.index(u, v)] < limit) {
            return Rim{distance, relief.index(u, v)};
        }
    }
    return std::nullopt;
}

/// For a pixel in a hole; otherwise an empty one.
Patch patch_of(const Relief& relief, int x, int y, int reach, float gap) {
    const float here = relief.depth[relief.index(x, y)];
    const float limit = here == Relief::kNothing ? Relief::kNothing : here - gap;
    int found = 0;
    int missed = 0;
    float depths = 0;
    Rim nearest{reach + 1, 0};
    for (const std::array<int, 2>& direction : kDirections) {
        const std::optional<Rim> rim = rim_of(relief, x, y, direction, reach, limit);
        if (rim) {
            ++found;
            depths += relief.depth[rim->pixel];
            nearest = rim->distance < nearest.distance ? *rim : nearest;
        } else if (++missed > kOpen) {
            return {};
        }
    }
    return {depths / static_cast<float>(found), nearest.pixel};
}

void close_holes(Relief& relief, int reach, float gap) {
    const Relief before{relief.width, relief.height, relief.depth, relief.code, relief.facing};
    parallel_for(static_cast<std::size_t>(relief.height), kRows,
                 [&](std::size_t begin, std::size_t end) {
                     for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
                         for (int x = 0; x < relief.width; ++x) {
                             const Patch patch = patch_of(before, x, y, reach, gap);
                             if (patch.depth != Relief::kNothing) {
                                 relief.depth[relief.index(x, y)] = patch.depth;
                                 relief.code[relief.index(x, y)] = before.code[patch.pixel];
                                 relief.facing[relief.index(x, y)] = before.facing[patch.pixel];
                             }
                         }
                     }
                 });
}

/// A plane: depth = depth at the centre + right * x + down * y.
struct Plane {
    float depth = 0;
    float right = 0;
    float down = 0;

    Facing facing() const {
        const float length = std::sqrt(1 + right * right + down * down);
        return {right / length, down / length, 1 / length};
    }
};

/// Sums for a plane of least squares, and a mean beside it.
struct PlaneSums {
    float n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, z = 0, xz = 0, yz = 0, value = 0;

    void add(float u, float v, float w, float what, float weight) {
        n += weight;
        x += weight * u;
        y += weight * v;
        xx += weight * u * u;
        xy += weight * u * v;
        yy += weight * v * v;
        z += weight * w;
        xz += weight * u * w;
        yz += weight * v * w;
        value += weight * what;
    }

    Plane plane() const {
        const float cxx = xx - x * x / n;
        const float cxy = xy - x * y / n;
        const float cyy = yy - y * y / n;
        const float cxz = xz - x * z / n;
        const float cyz = yz - y * z / n;
        const float determinant = cxx * cyy - cxy * cxy;
        if (!(determinant > 1e-6F)) {
            return {z / n};
        }
        const float right = (cxz * cyy - cyz * cxy) / determinant;
        const float down = (cyz * cxx - cxz * cxy) / determinant;
        return {(z - right * x - down * y) / n, right, down};
    }
};

/// The pixels round one: up to five to each side, of a large neighbourhood every so-many-th.
struct Window {
    int step = 1;
    int reach = 1;               // a multiple of the step, so that the pixel itself is one of them
    std::vector<float> weights;  // by the distance along an axis
};

Window window_of(int reach) {
    constexpr int kSteps = 5;
    Window window;
    window.step = (reach + kSteps - 1) / kSteps;
    window.reach = reach / window.step * window.step;
    for (int i = 0; i <= window.reach; ++i) {
        const float share = static_cast<float>(i) / (0.6F * static_cast<float>(reach));
        window.weights.push_back(std::exp(-share * share));
    }
    return window;
}

PlaneSums sums_at(const Relief& relief, const std::vector<float>& curvatures, const Window& window,
                  int x, int y) {
    // Steeper than this between two pixels is an edge.
    constexpr float kSteepest = 3.5F;
    const float here = relief.depth[relief.index(x, y)];
    PlaneSums sums;
    for (int dy = -window.reach; dy <= window.reach; dy += window.step) {
        for (int dx = -window.reach; dx <= window.reach; dx += window.step) {
            const int u = x + dx;
            const int v = y + dy;
            if (u < 0 || u >= relief.width || v < 0 || v >= relief.height) {
                continue;
            }
            const std::size_t i = relief.index(u, v);
            const float rise = relief.depth[i] - here;
            const int distance = std::max(std::abs(dx), std::abs(dy));
            if (std::abs(rise) <= kSteepest * static_cast<float>(distance + 1)) {
                sums.add(static_cast<float>(dx), static_cast<float>(dy), rise,
                         curvatures[relief.code[i]],
                         window.weights[static_cast<std::size_t>(std::abs(dx))] *
                             window.weights[static_cast<std::size_t>(std::abs(dy))]);
            }
        }
    }
    return sums;
}

}  // namespace

Relief relief_of(const SplatBuffer& splats, int reach, float gap) {
    Relief relief{splats.width(), splats.height(), {}, {}, {}};
    const std::size_t pixels = splats.pixels().size();
    relief.depth.assign(pixels, Relief::kNothing);
    relief.code.assign(pixels, 0);
    relief.facing.assign(pixels, 0);
    for (int y = 0; y < relief.height; ++y) {
        for (int x = 0; x < relief.width; ++x) {
            if (!splats.is_empty(x, y)) {
                const Splat splat = splats.at(x, y);
                const std::size_t i = relief.index(x, y);
                relief.depth[i] = static_cast<float>(splat.depth);
                relief.code[i] = static_cast<std::uint16_t>(splat.code);
                relief.facing[i] = splat.facing;
            }
        }
    }
    close_holes(relief, reach, gap);
    return relief;
}

void smooth(Relief& relief, const CurvatureScale& scale, int reach) {
    const Window window = window_of(reach);
    std::vector<float> curvatures(CurvatureScale::kCodes);
    for (std::uint32_t code = 0; code < CurvatureScale::kCodes; ++code) {
        curvatures[code] = static_cast<float>(scale.curvature_of(code));
    }
    std::vector<float> depth = relief.depth;
    std::vector<std::uint16_t> codes = relief.code;
    parallel_for(static_cast<std::size_t>(relief.height), kRows,
                 [&](std::size_t begin, std::size_t end) {
                     for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
                         for (int x = 0; x < relief.width; ++x) {
                             if (relief.is_empty(x, y)) {
                                 continue;
                             }
                             const std::size_t i = relief.index(x, y);
                             const PlaneSums sums = sums_at(relief, curvatures, window, x, y);
                             const Plane plane = sums.plane();
                             depth[i] += plane.depth;
                             relief.facing[i] = pack_facing(plane.facing());
                             codes[i] = static_cast<std::uint16_t>(
                                 scale.code_of(static_cast<double>(sums.value / sums.n)));
                         }
                     }
                 });
    relief.depth = std::move(depth);
    relief.code = std::move(codes);
}

CurvatureHistogram pixel_histogram(const Relief& relief) {
    CurvatureHistogram histogram;
    for (std::size_t i = 0; i < relief.depth.size(); ++i) {
        if (relief.depth[i] != Relief::kNothing) {
            histogram.add(relief.code[i]);
        }
    }
    return histogram;
}

}  // namespace knap
