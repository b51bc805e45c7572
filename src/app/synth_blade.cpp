#include <algorithm>
#include <cmath>
#include <cstddef>

#include "app/synth_surface.hpp"

namespace knap::app {

namespace {

constexpr double kLength = 60;
constexpr double kWidth = 20;
constexpr double kThickness = 1;
// Of the arc over half the width whose sagitta is half the thickness.
constexpr double kRadius = (kWidth * kWidth + kThickness * kThickness) / (4 * kThickness);

/// Angle of the arc from its middle to an edge.
double half_angle() {
    return std::asin(kWidth / 2 / kRadius);
}

/// A stretch along the blade, between two angles of the arc on one side.
class BladeStrip : public Strip {
  public:
    BladeStrip(double low, double high, double side) : low_(low), high_(high), side_(side) {}
    SurfacePoint at(double along, double across) const override {
        const double angle = low_ + across * (high_ - low_);
        const Vec3 normal{std::sin(angle), 0, side_ * std::cos(angle)};
        const double height = kRadius * std::cos(angle) - (kRadius - kThickness / 2);
        return {{kRadius * std::sin(angle), kLength * along, side_ * height}, normal};
    }

  private:
    double low_;
    double high_;
    double side_;
};

/// Two equal arcs that meet in sharp edges, drawn out: from one edge to the other over the upper
/// side, and on over the lower one. Its ends are open.
class Blade : public Surface {
  public:
    explicit Blade(std::uint64_t points) {
        const double area = 4 * half_angle() * kRadius * kLength;
        const double cell = std::sqrt(area / static_cast<double>(points));
        strips_a_side_ =
            static_cast<std::size_t>(std::max(1.0, std::round(2 * half_angle() * kRadius / cell)));
    }
    std::size_t strips() const override { return 2 * strips_a_side_; }
    double area(std::size_t /*strip*/) const override {
        return 2 * half_angle() * kRadius / static_cast<double>(strips_a_side_) * kLength;
    }
    std::unique_ptr<Strip> strip(std::size_t strip) const override {
        const bool upper = strip < strips_a_side_;
        const std::size_t at = upper ? strip : strip - strips_a_side_;
        return std::make_unique<BladeStrip>(angle(at), angle(at + 1), upper ? 1.0 : -1.0);
    }

  private:
    double angle(std::size_t at) const {
        return half_angle() *
               (2 * static_cast<double>(at) / static_cast<double>(strips_a_side_) - 1);
    }
    std::size_t strips_a_side_ = 1;
};

}  // namespace

std::unique_ptr<Surface> make_blade(std::uint64_t points) {
    return std::make_unique<Blade>(points);
}

}  // namespace knap::app
