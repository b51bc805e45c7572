#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "app/synth_surface.hpp"
#include "knap/geometry.hpp"

namespace knap::app {

enum class Shape {
    kFlake,    ///< a knapped stone tool, about 60 x 35 x 10: facets meeting in ridges, a thin edge
    kSphere,   ///< radius 1: |H| = 1 everywhere
    kTorus,    ///< radii 1 and 0.35: |H| = |1 + 0.7 cos v| / (0.7 (1 + 0.35 cos v)), v = 0 outside
    kBlade,    ///< 60 long, 20 wide, two arcs that meet in sharp edges, 1 thick in the middle: at x
               ///< from it 2 sqrt(R^2 - x^2) - 2 R + 1 thick, R = 100.25, |H| = 1 / (2 R)
    kTerrain,  ///< a height field of 1000 x 1000 with ridges, even in plan as an airborne scan is
};

/// The shape of a name: "flake", "sphere", "torus", "blade", "terrain".
std::optional<Shape> shape_of(std::string_view name);

struct SynthParams {
    Shape shape = Shape::kFlake;
    std::uint64_t points = 0;
    std::uint64_t seed = 1;
    double noise = 0;  ///< largest distance of a point from the surface, cloud units, >= 0
};

/// A cloud of any size as a pure function from index to point: one point in each cell of about
/// square cells of equal area, in the order of a scanner, strip by strip.
class SynthCloud {
  public:
    explicit SynthCloud(const SynthParams& params);

    /// The points `first`, `first` + 1, ... of the cloud. Thread-safe.
    /// @param first  first + out.size() <= points
    void fill(std::uint64_t first, std::span<Vec3> out) const;

  private:
    SynthParams params_;
    std::unique_ptr<Surface> surface_;
    std::vector<std::uint64_t> firsts_;  ///< first point of each strip, then the number of points
};

}  // namespace knap::app
