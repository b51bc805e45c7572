#include "app/synth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace knap::app {

namespace {

// Points keep to the middle of their cell along the strip, so that no two neighbours of a strip
// coincide.
constexpr double kJitterAlong = 0.8;

std::unique_ptr<Surface> make_surface(const SynthParams& params) {
    const std::uint64_t points = std::max<std::uint64_t>(params.points, 1);
    switch (params.shape) {
        case Shape::kSphere:
            return make_sphere(points);
        case Shape::kTorus:
            return make_torus(points);
        case Shape::kBlade:
            return make_blade(points);
        case Shape::kTerrain:
            return make_terrain(points, params.seed);
        case Shape::kFlake:
            break;
    }
    return make_flake(points, params.seed);
}

/// Shares the points out over the strips by area: rounded sums, so that they add up exactly.
std::vector<std::uint64_t> share_out(const Surface& surface, std::uint64_t points) {
    std::vector<double> sums{0};
    for (std::size_t i = 0; i < surface.strips(); ++i) {
        sums.push_back(sums.back() + surface.area(i));
    }
    std::vector<std::uint64_t> firsts;
    firsts.reserve(sums.size());
    for (const double sum : sums) {
        firsts.push_back(static_cast<std::uint64_t>(
            std::floor(sum / sums.back() * static_cast<double>(points) + 0.5)));
    }
    firsts.back() = points;
    return firsts;
}

}  // namespace

std::optional<Shape> shape_of(std::string_view name) {
    constexpr std::array<std::pair<std::string_view, Shape>, 5> kNames{
        {{"flake", Shape::kFlake},
         {"sphere", Shape::kSphere},
         {"torus", Shape::kTorus},
         {"blade", Shape::kBlade},
         {"terrain", Shape::kTerrain}}};
    const auto* const found = std::find_if(kNames.begin(), kNames.end(),
                                           [name](const auto& n) { return n.first == name; });
    return found == kNames.end() ? std::nullopt : std::optional(found->second);
}

double uniform(std::uint64_t key) {
    return static_cast<double>(key >> 11) * 0x1p-53;
}

std::uint64_t mix(std::uint64_t a, std::uint64_t b) {
    // The output function of splitmix64.
    std::uint64_t z = a + (b + 1) * 0x9e3779b97f4a7c15U;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
}

SynthCloud::SynthCloud(const SynthParams& params)
    : params_(params),
      surface_(make_surface(params)),
      firsts_(share_out(*surface_, params.points)) {}

void SynthCloud::fill(std::uint64_t first, std::span<Vec3> out) const {
    const std::uint64_t stream = mix(params_.seed, 0);
    auto strip = static_cast<std::size_t>(std::upper_bound(firsts_.begin(), firsts_.end(), first) -
                                          firsts_.begin() - 1);
    for (std::size_t done = 0; done < out.size(); ++strip) {
        const std::uint64_t begin = firsts_[strip];
        const std::uint64_t count = firsts_[strip + 1] - begin;
        const std::uint64_t stop = std::min<std::uint64_t>(firsts_[strip + 1], first + out.size());
        if (first + done >= stop) {
            continue;
        }
        const std::unique_ptr<Strip> band = surface_->strip(strip);
        for (std::uint64_t i = first + done; i < stop; ++i) {
            const std::uint64_t key = mix(stream, i);
            const double cell = 0.5 + kJitterAlong * (uniform(key) - 0.5);
            const double along =
                (static_cast<double>(i - begin) + cell) / static_cast<double>(count);
            SurfacePoint point = band->at(along, uniform(mix(key, 1)));
            if (params_.noise > 0) {
                // The sum of two uniform numbers: mild, and bounded.
                const double offset =
                    params_.noise * (uniform(mix(key, 2)) + uniform(mix(key, 3)) - 1);
                point.position.x += offset * point.normal.x;
                point.position.y += offset * point.normal.y;
                point.position.z += offset * point.normal.z;
            }
            out[done++] = point.position;
        }
    }
}

}  // namespace knap::app
