#include <cmath>
#include <numbers>

#include "app/synth_surface.hpp"

namespace knap::app {

namespace {

constexpr double kPi = std::numbers::pi;

/// Strips so many that a cell of `area` / `points` is about square.
std::size_t strips_for(double length, double area, std::uint64_t points) {
    const double side = std::sqrt(area / static_cast<double>(points));
    return static_cast<std::size_t>(std::max(1.0, std::round(length / side)));
}

/// A ring between two heights: by Archimedes, area is even in height and in longitude.
class SphereStrip : public Strip {
  public:
    SphereStrip(double low, double high) : low_(low), high_(high) {}
    SurfacePoint at(double along, double across) const override {
        const double z = low_ + across * (high_ - low_);
        const double radius = std::sqrt(std::max(0.0, 1 - z * z));
        const double angle = 2 * kPi * along;
        const Vec3 p{radius * std::cos(angle), radius * std::sin(angle), z};
        return {p, p};
    }

  private:
    double low_;
    double high_;
};

class Sphere : public Surface {
  public:
    explicit Sphere(std::uint64_t points) : strips_(strips_for(kPi, 4 * kPi, points)) {}
    std::size_t strips() const override { return strips_; }
    double area(std::size_t strip) const override {
        return 2 * kPi * (height(strip + 1) - height(strip));
    }
    std::unique_ptr<Strip> strip(std::size_t strip) const override {
        return std::make_unique<SphereStrip>(height(strip), height(strip + 1));
    }

  private:
    double height(std::size_t strip) const {
        return -std::cos(kPi * static_cast<double>(strip) / static_cast<double>(strips_));
    }
    std::size_t strips_;
};

constexpr double kMajor = 1.0;
constexpr double kMinor = 0.35;

class TorusStrip : public Strip {
  public:
    TorusStrip(double low, double high) : low_(low), high_(high) {}
    SurfacePoint at(double along, double across) const override {
        const double v = low_ + across * (high_ - low_);
        const double u = 2 * kPi * along;
        const Vec3 normal{std::cos(v) * std::cos(u), std::cos(v) * std::sin(u), std::sin(v)};
        const double radius = kMajor + kMinor * std::cos(v);
        return {{radius * std::cos(u), radius * std::sin(u), kMinor * std::sin(v)}, normal};
    }

  private:
    double low_;
    double high_;
};

/// Rings around the tube's axis. Inside a ring the points are even in the tube's angle, which is
/// even in area as far as the ring is narrow.
class Torus : public Surface {
  public:
    explicit Torus(std::uint64_t points)
        : strips_(strips_for(2 * kPi * kMinor, 4 * kPi * kPi * kMajor * kMinor, points)) {}
    std::size_t strips() const override { return strips_; }
    double area(std::size_t strip) const override {
        const double low = angle(strip);
        const double high = angle(strip + 1);
        return 2 * kPi * kMinor *
               (kMajor * (high - low) + kMinor * (std::sin(high) - std::sin(low)));
    }
    std::unique_ptr<Strip> strip(std::size_t strip) const override {
        return std::make_unique<TorusStrip>(angle(strip), angle(strip + 1));
    }

  private:
    double angle(std::size_t strip) const {
        return 2 * kPi * static_cast<double>(strip) / static_cast<double>(strips_);
    }
    std::size_t strips_;
};

}  // namespace

std::unique_ptr<Surface> make_sphere(std::uint64_t points) {
    return std::make_unique<Sphere>(points);
}

std::unique_ptr<Surface> make_torus(std::uint64_t points) {
    return std::make_unique<Torus>(points);
}

}  // namespace knap::app
