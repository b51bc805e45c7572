#include "report/shading.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "base/threads.hpp"

namespace knap {

namespace {

constexpr std::size_t kRows = 8;

/// The map in the steps of a screen.
std::vector<Light> tabulate_map() {
    std::vector<Light> table(256);
    for (std::size_t i = 0; i < table.size(); ++i) {
        table[i] = map_colour(static_cast<double>(i) / 255);
    }
    return table;
}

Light times(const Light& light, float factor) {
    return {light.red * factor, light.green * factor, light.blue * factor};
}

Light sum(const Light& a, const Light& b) {
    return {a.red + b.red, a.green + b.green, a.blue + b.blue};
}

/// How much of the light reaches a pixel past what stands before it.
float openness(const Relief& relief, int x, int y) {
    constexpr std::array<std::array<int, 2>, 8> kWays{
        {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
    constexpr std::array<int, 3> kRadii{2, 6, 16};
    constexpr std::array<float, 3> kStrength{0.35F, 0.45F, 0.45F};
    const float here = relief.depth[relief.index(x, y)];
    float shadow = 0;
    for (std::size_t ring = 0; ring < kRadii.size(); ++ring) {
        float before = 0;
        for (const auto& [dx, dy] : kWays) {
            const int u = x + dx * kRadii[ring];
            const int v = y + dy * kRadii[ring];
            if (u >= 0 && u < relief.width && v >= 0 && v < relief.height) {
                const float rise = here - relief.depth[relief.index(u, v)];
                // What lies on the plane of the pixel is no shade: half of the ways rise there.
                before += std::clamp(rise / static_cast<float>(kRadii[ring]), -1.5F, 1.5F);
            }
        }
        shadow += kStrength[ring] * std::max(0.0F, before / 8);
    }
    return std::exp(-1.6F * shadow);
}

/// Brightness of a surface that faces somewhere: a lamp at the upper left, a weaker one at the
/// right, and light from all sides.
float brightness(const Facing& facing) {
    const auto lamp = [&](float x, float y, float z) {
        return std::max(0.0F, facing.x * x + facing.y * y + facing.z * z);
    };
    return 0.16F + 0.72F * lamp(-0.48F, -0.56F, 0.675F) + 0.22F * lamp(0.78F, 0.10F, 0.618F);
}

/// Makes one pixel of four.
/// @param light  of a pixel of the larger picture
Image halve(int width, int height, const std::function<Light(int, int)>& light) {
    Image image(width / 2, height / 2);
    parallel_for(
        static_cast<std::size_t>(image.height), kRows, [&](std::size_t begin, std::size_t end) {
            for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
                for (int x = 0; x < image.width; ++x) {
                    const Light top = sum(light(2 * x, 2 * y), light(2 * x + 1, 2 * y));
                    const Light bottom = sum(light(2 * x, 2 * y + 1), light(2 * x + 1, 2 * y + 1));
                    image.at(x, y) = to_screen(times(sum(top, bottom), 0.25F));
                }
            }
        });
    return image;
}

std::size_t step_of(const CurvatureColours& colours, std::uint32_t code) {
    return static_cast<std::size_t>(std::lround(colours.place_of(code) * 255));
}

}  // namespace

Image shade(const Relief& relief, const CurvatureColours& colours) {
    const std::vector<Light> map = tabulate_map();
    return halve(relief.width, relief.height, [&](int x, int y) {
        const std::size_t i = relief.index(x, y);
        if (relief.is_empty(x, y)) {
            return kBackground;
        }
        return times(map[step_of(colours, relief.code[i])],
                     brightness(unpack_facing(relief.facing[i])) * openness(relief, x, y));
    });
}

Image shade_dots(const Relief& relief, const SplatBuffer& dots, const CurvatureColours& colours) {
    const std::vector<Light> map = tabulate_map();
    constexpr Light kStone{0.105F, 0.115F, 0.130F};
    return halve(relief.width, relief.height, [&](int x, int y) {
        if (!dots.is_empty(x, y)) {
            return map[step_of(colours, dots.at(x, y).code)];
        }
        if (relief.is_empty(x, y)) {
            return kBackground;
        }
        return times(kStone, brightness(unpack_facing(relief.facing[relief.index(x, y)])) *
                                 openness(relief, x, y));
    });
}

}  // namespace knap
