#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace knap {

/// Position of a point in the stream of all inputs in the order given, from 0.
using PointId = std::uint64_t;

/// A position or vector, cloud units.
struct Vec3 {
    double x = 0;
    double y = 0;
    double z = 0;

    double& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
    double operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
    friend bool operator==(const Vec3&, const Vec3&) = default;
};

inline Vec3 operator+(const Vec3& a, const Vec3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec3 operator-(const Vec3& a, const Vec3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

inline bool is_finite(const Vec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

/// Squared Euclidean distance. The one arithmetic by which knap compares distances: evaluated in
/// this order, without fused operations, so that equal distances are equal everywhere.
inline double squared_distance(const Vec3& a, const Vec3& b) {
    const double dx = a.x - b.x;
    const double dy = a.y - b.y;
    const double dz = a.z - b.z;
    return dx * dx + dy * dy + dz * dz;
}

/// An axis-aligned box, cloud units; empty until something is put in.
struct Box {
    Vec3 min{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
             std::numeric_limits<double>::infinity()};
    Vec3 max{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
             -std::numeric_limits<double>::infinity()};

    bool empty() const { return !(min.x <= max.x); }
    void extend(const Vec3& p) {
        min = {std::min(min.x, p.x), std::min(min.y, p.y), std::min(min.z, p.z)};
        max = {std::max(max.x, p.x), std::max(max.y, p.y), std::max(max.z, p.z)};
    }
    void extend(const Box& other) {
        if (!other.empty()) {
            extend(other.min);
            extend(other.max);
        }
    }
    bool contains(const Vec3& p) const {
        return p.x >= min.x && p.x <= max.x && p.y >= min.y && p.y <= max.y && p.z >= min.z &&
               p.z <= max.z;
    }
    Vec3 size() const { return empty() ? Vec3{} : max - min; }
    /// The axis along which the box is longest, the first of equally long ones; 0 if empty.
    int longest_axis() const {
        const Vec3 s = size();
        return s.x >= s.y && s.x >= s.z ? 0 : s.y >= s.z ? 1 : 2;
    }
    double diagonal() const {
        const Vec3 s = size();
        return std::sqrt(s.x * s.x + s.y * s.y + s.z * s.z);
    }
    /// Squared distance from `p` to the nearest point of the box; 0 inside, infinite if empty.
    double squared_distance_to(const Vec3& p) const {
        if (empty()) {
            return std::numeric_limits<double>::infinity();
        }
        const Vec3 nearest{std::clamp(p.x, min.x, max.x), std::clamp(p.y, min.y, max.y),
                           std::clamp(p.z, min.z, max.z)};
        return squared_distance(p, nearest);
    }
    /// Squared distance between the nearest points of two boxes; infinite if one is empty. By the
    /// arithmetic of squared_distance(), each step of which is monotone: no two points are nearer.
    double squared_distance_to(const Box& other) const {
        if (empty() || other.empty()) {
            return std::numeric_limits<double>::infinity();
        }
        const auto gap = [](double low, double high, double other_low, double other_high) {
            return std::max(std::max(other_low - high, low - other_high), 0.0);
        };
        return squared_distance({gap(min.x, max.x, other.min.x, other.max.x),
                                 gap(min.y, max.y, other.min.y, other.max.y),
                                 gap(min.z, max.z, other.min.z, other.max.z)},
                                {0, 0, 0});
    }
    friend bool operator==(const Box&, const Box&) = default;
};

}  // namespace knap
