#include <cmath>

#include "app/synth_surface.hpp"

namespace knap::app {

namespace {

constexpr double kSize = 1000;          // cloud units, both sides
constexpr double kCellOfFirst = 400;    // cloud units, cell of the coarsest octave
constexpr double kHeightOfFirst = 200;  // cloud units
constexpr int kOctaves = 6;
constexpr int kRidged = 3;

/// A height and its slope.
struct Height {
    double z = 0;
    double dx = 0;
    double dy = 0;
};

/// A slope at a corner of the grid: both parts in [-1, 1).
struct Slope {
    double x;
    double y;

    double at(double dx, double dy) const { return x * dx + y * dy; }
};

Slope corner(std::uint64_t column, std::uint64_t row) {
    const std::uint64_t key = mix(column, row);
    return {static_cast<double>(key >> 32) * 0x1p-31 - 1,
            static_cast<double>(key & 0xffffffffU) * 0x1p-31 - 1};
}

/// Gradient noise about 0 on the unit grid, smooth to the second derivative (Perlin 2002).
Height smooth_noise(double x, double y, std::uint64_t seed) {
    const double fx = std::floor(x);
    const double fy = std::floor(y);
    const auto row = static_cast<std::uint64_t>(static_cast<std::int64_t>(fy));
    const auto left_key = static_cast<std::uint64_t>(static_cast<std::int64_t>(fx));
    const std::uint64_t left = mix(seed, left_key);
    const std::uint64_t right = mix(seed, left_key + 1);
    const Slope a = corner(left, row);
    const Slope b = corner(right, row);
    const Slope c = corner(left, row + 1);
    const Slope d = corner(right, row + 1);
    const double u = x - fx;
    const double v = y - fy;
    const double su = u * u * u * (u * (u * 6 - 15) + 10);
    const double sv = v * v * v * (v * (v * 6 - 15) + 10);
    const double du = 30 * u * u * (u - 1) * (u - 1);
    const double dv = 30 * v * v * (v - 1) * (v - 1);
    const double za = a.at(u, v);
    const double zb = b.at(u - 1, v);
    const double zc = c.at(u, v - 1);
    const double zd = d.at(u - 1, v - 1);
    const double cross = za - zb - zc + zd;
    const auto blend = [&](double pa, double pb, double pc, double pd) {
        return pa + (pb - pa) * su + (pc - pa) * sv + (pa - pb - pc + pd) * su * sv;
    };
    return {blend(za, zb, zc, zd), blend(a.x, b.x, c.x, d.x) + du * (zb - za + cross * sv),
            blend(a.y, b.y, c.y, d.y) + dv * (zc - za + cross * su)};
}

/// Octaves of noise, each turned against the one before; the coarse ones folded at zero, which
/// makes ridges.
Height terrain(double x, double y, std::uint64_t seed) {
    Height sum;
    double cell = kCellOfFirst;
    double height = kHeightOfFirst;
    double cos = 1;
    double sin = 0;
    for (int octave = 0; octave < kOctaves; ++octave) {
        Height h = smooth_noise((cos * x + sin * y) / cell, (cos * y - sin * x) / cell,
                                mix(seed, static_cast<std::uint64_t>(octave)));
        if (octave < kRidged) {
            const double sign = h.z < 0 ? 1 : -1;
            h = {1 + sign * h.z, sign * h.dx, sign * h.dy};
        }
        sum.z += height * h.z;
        sum.dx += height / cell * (cos * h.dx - sin * h.dy);
        sum.dy += height / cell * (sin * h.dx + cos * h.dy);
        cell *= 0.47;  // not a half: no two grids share their lines
        height *= 0.36;
        const double turned = 0.8 * cos - 0.6 * sin;
        sin = 0.6 * cos + 0.8 * sin;
        cos = turned;
    }
    return sum;
}

class TerrainStrip : public Strip {
  public:
    TerrainStrip(double low, double width, std::uint64_t seed)
        : low_(low), width_(width), seed_(seed) {}
    SurfacePoint at(double along, double across) const override {
        const double x = kSize * along;
        const double y = low_ + width_ * across;
        const Height h = terrain(x, y, seed_);
        const double length = std::sqrt(h.dx * h.dx + h.dy * h.dy + 1);
        return {{x, y, h.z}, {-h.dx / length, -h.dy / length, 1 / length}};
    }

  private:
    double low_;
    double width_;
    std::uint64_t seed_;
};

class Terrain : public Surface {
  public:
    Terrain(std::uint64_t points, std::uint64_t seed)
        : strips_(static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(points))))),
          seed_(seed) {}
    std::size_t strips() const override { return strips_; }
    // Even in plan: every strip of the same width holds as many points.
    double area(std::size_t /*strip*/) const override { return kSize * width(); }
    std::unique_ptr<Strip> strip(std::size_t strip) const override {
        return std::make_unique<TerrainStrip>(static_cast<double>(strip) * width(), width(), seed_);
    }

  private:
    double width() const { return kSize / static_cast<double>(strips_); }
    std::size_t strips_;
    std::uint64_t seed_;
};

}  // namespace

std::unique_ptr<Surface> make_terrain(std::uint64_t points, std::uint64_t seed) {
    return std::make_unique<Terrain>(points, seed);
}

}  // namespace knap::app
