#include "report/colour_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace knap {

namespace {

/// A colour by what the eye sees of it: lightness, strength, and hue in degrees.
struct Seen {
    double lightness = 0;
    double chroma = 0;
    double hue = 0;
};

// Evenly spaced, lightness too.
constexpr std::array<Seen, 6> kAnchors{{{0.930, 0.020, 95},
                                        {0.845, 0.085, 88},
                                        {0.760, 0.145, 66},
                                        {0.675, 0.185, 42},
                                        {0.590, 0.205, 22},
                                        {0.505, 0.190, 2}}};

// Source: Ottosson, A perceptual color space for image processing, 2020.
Light light_of(double lightness, double a, double b) {
    const auto cube = [](double v) { return v * v * v; };
    const double l = cube(lightness + 0.3963377774 * a + 0.2158037573 * b);
    const double m = cube(lightness - 0.1055613458 * a - 0.0638541728 * b);
    const double s = cube(lightness - 0.0894841775 * a - 1.2914855480 * b);
    const auto inside = [](double v) { return static_cast<float>(std::clamp(v, 0.0, 1.0)); };
    return {inside(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
            inside(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
            inside(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s)};
}

std::uint8_t to_screen(float light) {
    const double v = std::clamp(static_cast<double>(light), 0.0, 1.0);
    const double shown = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
    return static_cast<std::uint8_t>(std::lround(shown * 255));
}

}  // namespace

Colour to_screen(const Light& light) {
    return {to_screen(light.red), to_screen(light.green), to_screen(light.blue)};
}

Light map_colour(double place) {
    const double at = std::clamp(place, 0.0, 1.0) * (kAnchors.size() - 1);
    const std::size_t first = std::min(static_cast<std::size_t>(at), kAnchors.size() - 2);
    const double share = at - static_cast<double>(first);
    const Seen& from = kAnchors[first];
    const Seen& to = kAnchors[first + 1];
    const auto mixed = [&](double a, double b) { return a + share * (b - a); };
    const auto axis = [&](double (*of)(double)) {
        constexpr double kDegree = std::numbers::pi / 180;
        return mixed(from.chroma * of(from.hue * kDegree), to.chroma * of(to.hue * kDegree));
    };
    return light_of(mixed(from.lightness, to.lightness), axis(std::cos), axis(std::sin));
}

CurvatureColours CurvatureColours::of(const CurvatureHistogram& histogram) {
    return {histogram.quantile(kLowShare), histogram.quantile(kHighShare)};
}

double CurvatureColours::place_of(std::uint32_t code) const {
    if (code <= low) {
        return 0;
    }
    return code >= high ? 1 : static_cast<double>(code - low) / (high - low);
}

}  // namespace knap
