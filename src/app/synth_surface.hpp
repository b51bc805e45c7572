#pragma once

#include <cstdint>
#include <memory>

#include "knap/geometry.hpp"

namespace knap::app {

/// A point of a surface and the unit normal there.
struct SurfacePoint {
    Vec3 position;
    Vec3 normal;
};

/// A narrow band of a surface.
class Strip {
  public:
    virtual ~Strip() = default;
    /// @param along   share of the strip's area that lies before the point, [0, 1)
    /// @param across  share of the strip's area that lies beside it, [0, 1)
    virtual SurfacePoint at(double along, double across) const = 0;
};

/// A surface cut into strips that are about as wide as the points of a cloud lie apart.
class Surface {
  public:
    virtual ~Surface() = default;
    virtual std::size_t strips() const = 0;
    /// Area of a strip, cloud units squared.
    virtual double area(std::size_t strip) const = 0;
    virtual std::unique_ptr<Strip> strip(std::size_t strip) const = 0;
};

/// @param points  how many points the strips are cut for, >= 1
std::unique_ptr<Surface> make_sphere(std::uint64_t points);
std::unique_ptr<Surface> make_torus(std::uint64_t points);
std::unique_ptr<Surface> make_blade(std::uint64_t points);
/// @param seed  chooses the hills and scars
std::unique_ptr<Surface> make_terrain(std::uint64_t points, std::uint64_t seed);
std::unique_ptr<Surface> make_flake(std::uint64_t points, std::uint64_t seed);

/// A uniform number in [0, 1) from a key: the same on every machine.
double uniform(std::uint64_t key);

/// Mixes two keys into one.
std::uint64_t mix(std::uint64_t a, std::uint64_t b);

}  // namespace knap::app
