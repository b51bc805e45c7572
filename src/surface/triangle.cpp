#include "surface/triangle.hpp"

#include <algorithm>

namespace knap {

namespace {

double dot(const Vec3& a, const Vec3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

double squared_distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
    const Vec3 along = b - a;
    const double length = dot(along, along);
    const double t = length > 0 ? std::clamp(dot(p - a, along) / length, 0.0, 1.0) : 0.0;
    return squared_distance(p, {a.x + t * along.x, a.y + t * along.y, a.z + t * along.z});
}

}  // namespace

double squared_distance_to_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 ab = b - a;
    const Vec3 ac = c - a;
    const Vec3 ap = p - a;
    // Barycentric coordinates of the foot of p in the plane, times the squared area.
    const double d00 = dot(ab, ab);
    const double d01 = dot(ab, ac);
    const double d11 = dot(ac, ac);
    const double d20 = dot(ap, ab);
    const double d21 = dot(ap, ac);
    const double area = d00 * d11 - d01 * d01;
    const double v = d11 * d20 - d01 * d21;
    const double w = d00 * d21 - d01 * d20;
    if (area > 0 && v >= 0 && w >= 0 && v + w <= area) {
        const double s = v / area;
        const double t = w / area;
        return squared_distance(
            p, {a.x + s * ab.x + t * ac.x, a.y + s * ab.y + t * ac.y, a.z + s * ab.z + t * ac.z});
    }
    return std::min({squared_distance_to_segment(p, a, b), squared_distance_to_segment(p, b, c),
                     squared_distance_to_segment(p, c, a)});
}

}  // namespace knap
