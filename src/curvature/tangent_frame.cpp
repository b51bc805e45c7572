#include "curvature/tangent_frame.hpp"

#include <cmath>
#include <limits>

#include "base/vector.hpp"

namespace knap {

namespace {

Vec3 axis_of(const PrincipalAxes& axes, PrincipalAxes::Axis axis, std::size_t which) {
    return {axes.axes[axis][0][which], axes.axes[axis][1][which], axes.axes[axis][2][which]};
}

Vec3 combined(double x, const Vec3& a, double y, const Vec3& b, double z, const Vec3& c) {
    return {x * a.x + y * b.x + z * c.x, x * a.y + y * b.y + z * c.y, x * a.z + y * b.z + z * c.z};
}

// In the frame's coordinates: a direction of the tangent plane, and the curvature along it.
struct Principal {
    Vec3 direction;
    double curvature = 0;
};

// Of the two principal directions the one of smaller |curvature|, and the other curvature. Along
// (u, v) over the frame's plane the surface has the first form E u^2 + 2 F u v + G v^2 and the
// second L u^2 + 2 M u v + N v^2, but for a common factor.
Principal flattest(double d, double e, double l, double m, double n, double& other) {
    // An orthonormal basis of the tangent plane: (1, 0, d) / r and what stands on it.
    const double r = std::sqrt(1 + d * d);
    const double s = std::sqrt(1 + d * d + e * e);
    const Vec3 first{1 / r, 0, d / r};
    const Vec3 second{-d * e / (r * s), r / s, e / (r * s)};
    const double a = l * first.x * first.x;
    const double b = l * first.x * second.x + m * first.x * second.y;
    const double c =
        l * second.x * second.x + 2 * m * second.x * second.y + n * second.y * second.y;
    const double middle = (a + c) / 2;
    const double half = (a - c) / 2;
    const double radius = std::sqrt(half * half + b * b);
    // The eigenvalue of smaller size is on the side of the middle where 0 is.
    const double small = middle > 0 ? middle - radius : middle + radius;
    other = middle > 0 ? middle + radius : middle - radius;
    double u = b;
    double v = small - a;
    if (std::abs(small - a) < std::abs(small - c)) {
        u = small - c;
        v = b;
    }
    const double length = std::sqrt(u * u + v * v);
    if (!(length > 0) || !std::isfinite(length)) {
        return {first, small};
    }
    return {combined(u / length, first, v / length, second, 0, {}), small};
}

}  // namespace

LocalFrame tangent_frame(const Quadrics& quadrics, const PrincipalAxes& axes, std::size_t which) {
    const auto coefficient = [&](Quadrics::Coefficient name) { return quadrics.of[name][which]; };
    const double d = coefficient(Quadrics::kX);
    const double e = coefficient(Quadrics::kY);
    double other = 0;
    const Principal flat =
        flattest(d, e, 2 * coefficient(Quadrics::kXX), coefficient(Quadrics::kXY),
                 2 * coefficient(Quadrics::kYY), other);
    const Vec3 x = axis_of(axes, PrincipalAxes::kFirst, which);
    const Vec3 y = axis_of(axes, PrincipalAxes::kSecond, which);
    const Vec3 z = axis_of(axes, PrincipalAxes::kNormal, which);
    const double steepness = std::sqrt(1 + d * d + e * e);
    // The surface bends towards its normal where the sum of its curvatures is positive.
    const double up = flat.curvature + other < 0 ? -1 : 1;

    LocalFrame frame;
    frame.normal = combined(-up * d / steepness, x, -up * e / steepness, y, up / steepness, z);
    frame.flattest = combined(flat.direction.x, x, flat.direction.y, y, flat.direction.z, z);
    frame.steepest = cross(frame.normal, frame.flattest);
    const double ratio = std::sqrt(std::abs(other) / std::abs(flat.curvature));
    frame.flatness = other == 0             ? 1
                     : flat.curvature == 0  ? std::numeric_limits<double>::infinity()
                     : std::isfinite(ratio) ? ratio
                                            : 1;
    if (!is_finite(frame.normal) || !is_finite(frame.flattest)) {
        return tangent_frame(1, axes, which);
    }
    return frame;
}

LocalFrame tangent_frame(double curvature, const PrincipalAxes& axes, std::size_t which) {
    LocalFrame frame;
    frame.normal = axis_of(axes, PrincipalAxes::kNormal, which);
    if (curvature < 0) {
        frame.normal = Vec3{} - frame.normal;
    }
    frame.flattest = axis_of(axes, PrincipalAxes::kFirst, which);
    frame.steepest = cross(frame.normal, frame.flattest);
    return frame;
}

}  // namespace knap
