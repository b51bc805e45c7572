#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "app/synth_surface.hpp"

namespace knap::app {

namespace {

constexpr double kPi = std::numbers::pi;
// Of the ellipse that the scars come down to; the corners between them reach a little past it.
constexpr double kHalfLength = 29.5;   // mm
constexpr double kHalfWidth = 16;      // mm
constexpr double kDorsalHeight = 6.5;  // mm above the rim
constexpr double kVentralDepth = 3.5;  // mm below it
constexpr int kScars = 5;              // large scars of the back, which meet in its ridges
constexpr int kRetouch = 11;           // small, steep ones along the edge
constexpr std::size_t kOutline = 1 << 16;
constexpr std::size_t kBins = 256;

/// A scar of the back: a shallow trough that falls towards one side,
/// z = top + fall q + hollow (q^2 + (w - axis)^2), q along the fall and w across it.
struct Scar {
    double cos = 1;
    double sin = 0;
    double top = 0;
    double fall = 0;
    double hollow =
        0;            ///< 1 / mm; > 0, so that the scar is concave and two of them meet in a ridge
    double axis = 0;  ///< mm
};

/// A height over the plan, mm, and its slope.
struct Height {
    double z = 0;
    double dx = 0;
    double dy = 0;

    double stretch() const { return std::sqrt(1 + dx * dx + dy * dy); }
};

Height scar_height(const Scar& scar, double x, double y) {
    const double q = x * scar.cos + y * scar.sin;
    const double w = y * scar.cos - x * scar.sin - scar.axis;
    const double along = scar.fall + 2 * scar.hollow * q;
    const double across = 2 * scar.hollow * w;
    return {scar.top + scar.fall * q + scar.hollow * (q * q + w * w),
            along * scar.cos - across * scar.sin, along * scar.sin + across * scar.cos};
}

Height ventral_height(double x, double y) {
    const double fx = x / (kHalfLength * kHalfLength);
    const double fy = y / (kHalfWidth * kHalfWidth);
    return {kVentralDepth * (fx * x + fy * y - 1), 2 * kVentralDepth * fx, 2 * kVentralDepth * fy};
}

/// A scar that starts `top` high over the centre and comes down to the rim of an ellipse.
/// @param sag  how far it is hollowed below the straight line between the two, mm
Scar make_scar(double direction, double top, double sag, double reach, double axis) {
    const double c = std::cos(direction);
    const double s = std::sin(direction);
    const double distance = reach * std::hypot(kHalfLength * c, kHalfWidth * s);
    const double hollow = 4 * sag / (distance * distance);
    return {c, s, top, -(top + 4 * sag) / distance, hollow, axis};
}

std::vector<Scar> make_scars(std::uint64_t seed) {
    std::uint64_t drawn = 0;
    const auto draw = [&](double low, double high) {
        return low + (high - low) * uniform(mix(seed, ++drawn));
    };
    std::vector<Scar> scars;
    const double turn = draw(0, 2 * kPi);
    for (int i = 0; i < kScars; ++i) {
        const double direction = turn + 2 * kPi * (i + draw(-0.25, 0.25)) / kScars;
        scars.push_back(make_scar(direction, kDorsalHeight * draw(1, 1.25), draw(0.3, 0.9),
                                  draw(0.97, 1.05), draw(-4, 4)));
    }
    for (int i = 0; i < kRetouch; ++i) {
        const double direction = turn + 2 * kPi * (i + draw(-0.4, 0.4)) / kRetouch;
        scars.push_back(make_scar(direction, kDorsalHeight * draw(1.6, 3.2), draw(0.5, 1.5),
                                  draw(0.96, 1.04), draw(-3, 3)));
    }
    return scars;
}

class FlakeStrip;

/// The body between the scars of the back and the bulging ventral face. Seen in plan it is all that
/// a ray from the centre reaches before the two meet: in the thin edge.
class Flake : public Surface {
  public:
    Flake(std::uint64_t points, std::uint64_t seed);

    std::size_t strips() const override { return 2 * rings_; }
    double area(std::size_t strip) const override;
    std::unique_ptr<Strip> strip(std::size_t strip) const override;

    Height height(bool dorsal, double x, double y) const;

    /// Distance of the edge from the centre in a direction, as a share of a full turn in [0, 1).
    double edge(double turn) const {
        const double place = turn * kOutline;
        const auto i = static_cast<std::size_t>(place);
        const double part = place - static_cast<double>(i);
        return outline_[i] + part * (outline_[i + 1] - outline_[i]);
    }

  private:
    double ray(double angle) const;
    FlakeStrip ring(std::size_t strip) const;

    std::vector<Scar> scars_;
    std::vector<double> outline_;
    std::size_t rings_ = 1;
};

/// A ring of the plan between two scaled copies of the outline, on one face.
class FlakeStrip : public Strip {
  public:
    FlakeStrip(const Flake& flake, bool dorsal, double inner, double outer);

    double area() const { return sums_.back(); }
    SurfacePoint at(double along, double across) const override;

  private:
    const Flake& flake_;
    bool dorsal_;
    double inner_;
    double outer_;
    std::array<double, kBins + 1> sums_{};  ///< area up to each of kBins directions, mm^2
};

FlakeStrip::FlakeStrip(const Flake& flake, bool dorsal, double inner, double outer)
    : flake_(flake), dorsal_(dorsal), inner_(inner), outer_(outer) {
    const double share = (outer * outer - inner * inner) * kPi / kBins;
    for (std::size_t i = 0; i < kBins; ++i) {
        const double turn = (static_cast<double>(i) + 0.5) / kBins;
        const double edge = flake.edge(turn);
        const double middle = edge * (inner + outer) / 2;
        const Height h = flake.height(dorsal, middle * std::cos(2 * kPi * turn),
                                      middle * std::sin(2 * kPi * turn));
        sums_[i + 1] = sums_[i] + share * edge * edge * h.stretch();
    }
}

SurfacePoint FlakeStrip::at(double along, double across) const {
    const double wanted = along * sums_.back();
    const auto* const above = std::upper_bound(sums_.begin() + 1, sums_.end() - 1, wanted);
    const double before = *(above - 1);
    const double part = std::min((wanted - before) / (*above - before), 1 - 1e-9);
    const double turn = (static_cast<double>(above - 1 - sums_.begin()) + part) / kBins;
    const double scale = std::sqrt(inner_ * inner_ + across * (outer_ * outer_ - inner_ * inner_));
    const double distance = scale * flake_.edge(turn);
    const double x = distance * std::cos(2 * kPi * turn);
    const double y = distance * std::sin(2 * kPi * turn);
    const Height h = flake_.height(dorsal_, x, y);
    const double length = (dorsal_ ? 1 : -1) * h.stretch();
    return {{x, y, h.z}, {-h.dx / length, -h.dy / length, 1 / length}};
}

Flake::Flake(std::uint64_t points, std::uint64_t seed)
    : scars_(make_scars(seed)), outline_(kOutline + 1) {
    double plan = 0;
    for (std::size_t i = 0; i < kOutline; ++i) {
        outline_[i] = ray(2 * kPi * static_cast<double>(i) / kOutline);
        plan += outline_[i] * outline_[i] * kPi / kOutline;
    }
    outline_[kOutline] = outline_[0];
    const double side = std::sqrt(2 * plan / static_cast<double>(points));
    rings_ = static_cast<std::size_t>(std::max(1.0, std::round(std::sqrt(plan / kPi) / side)));
}

/// Where the first scar meets the ventral face along a ray: the smallest positive root of the
/// body's thickness, a quadratic for each scar.
double Flake::ray(double angle) const {
    const double x = std::cos(angle);
    const double y = std::sin(angle);
    const double bulge = ventral_height(x, y).z + kVentralDepth;
    double nearest = std::numeric_limits<double>::infinity();
    for (const Scar& scar : scars_) {
        const double q = x * scar.cos + y * scar.sin;
        const double w = y * scar.cos - x * scar.sin;
        const double c0 = scar.top + scar.hollow * scar.axis * scar.axis + kVentralDepth;
        const double c1 = scar.fall * q - 2 * scar.hollow * scar.axis * w;
        const double c2 = scar.hollow - bulge;
        const double root = c1 * c1 - 4 * c2 * c0;
        const double divisor = root >= 0 ? std::sqrt(root) - c1 : 0;
        if (divisor > 0) {
            nearest = std::min(nearest, 2 * c0 / divisor);
        }
    }
    return nearest;
}

Height Flake::height(bool dorsal, double x, double y) const {
    if (!dorsal) {
        return ventral_height(x, y);
    }
    Height lowest = scar_height(scars_[0], x, y);
    for (std::size_t i = 1; i < scars_.size(); ++i) {
        const Height h = scar_height(scars_[i], x, y);
        if (h.z < lowest.z) {
            lowest = h;
        }
    }
    return lowest;
}

/// The back from the centre to the edge, then the ventral face from the edge to the centre.
FlakeStrip Flake::ring(std::size_t strip) const {
    const bool dorsal = strip < rings_;
    const std::size_t place = dorsal ? strip : 2 * rings_ - 1 - strip;
    const auto rings = static_cast<double>(rings_);
    return {*this, dorsal, static_cast<double>(place) / rings,
            static_cast<double>(place + 1) / rings};
}

double Flake::area(std::size_t strip) const {
    return ring(strip).area();
}

std::unique_ptr<Strip> Flake::strip(std::size_t strip) const {
    return std::make_unique<FlakeStrip>(ring(strip));
}

}  // namespace

std::unique_ptr<Surface> make_flake(std::uint64_t points, std::uint64_t seed) {
    return std::make_unique<Flake>(points, seed);
}

}  // namespace knap::app
