#include "surface/triangle.hpp"

#include <algorithm>

#include "base/vector.hpp"

namespace knap {

namespace {

double squared_distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
    const Vec3 along = b - a;
    const double length = dot(along, along);
    const double t = length > 0 ? std::clamp(dot(p - a, along) / length, 0.0, 1.0) : 0.0;
    return squared_distance(p, {a.x + t * along.x, a.y + t * along.y, a.z + t * along.z});
}

}  // namespace

// By the region of the plane that the foot of p is in (Ericson, Real-Time Collision
// Detection, 5.1.5).
double squared_distance_to_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 ab = b - a;
    const Vec3 ac = c - a;
    const Vec3 ap = p - a;
    const Vec3 bp = p - b;
    const Vec3 cp = p - c;
    const auto to = [&](double v, double w) {
        return squared_distance(
            p, {a.x + v * ab.x + w * ac.x, a.y + v * ab.y + w * ac.y, a.z + v * ab.z + w * ac.z});
    };
    const double a1 = dot(ab, ap);
    const double a2 = dot(ac, ap);
    if (a1 <= 0 && a2 <= 0) {
        return dot(ap, ap);
    }
    const double b1 = dot(ab, bp);
    const double b2 = dot(ac, bp);
    if (b1 >= 0 && b2 <= b1) {
        return dot(bp, bp);
    }
    const double c1 = dot(ab, cp);
    const double c2 = dot(ac, cp);
    if (c2 >= 0 && c1 <= c2) {
        return dot(cp, cp);
    }
    // Barycentric coordinates of the foot, times one positive number.
    const double of_a = b1 * c2 - c1 * b2;
    const double of_b = c1 * a2 - a1 * c2;
    const double of_c = a1 * b2 - b1 * a2;
    const double sum = of_a + of_b + of_c;
    if (of_a > 0 && of_b > 0 && of_c > 0 && sum > 0) {
        return to(of_b / sum, of_c / sum);
    }
    return std::min({squared_distance_to_segment(p, a, b), squared_distance_to_segment(p, b, c),
                     squared_distance_to_segment(p, c, a)});
}

}  // namespace knap
