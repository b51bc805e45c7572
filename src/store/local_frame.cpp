#include "store/local_frame.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "base/vector.hpp"

namespace knap {

namespace {

// A coordinate of the unfolded octahedron, [-1, 1], has 255 steps; 0 is one of them.
constexpr double kSteps = 127;
constexpr double kDirections = 16;
constexpr double kFlatnesses = 15;
constexpr double kMostFlatness = 4;

Vec3 scaled_to_one(const Vec3& v) {
    const double length = std::sqrt(dot(v, v));
    return {v.x / length, v.y / length, v.z / length};
}

// The lower half of the octahedron is folded outwards; folding twice gives back what was.
std::pair<double, double> folded(double x, double y) {
    return {std::copysign(1 - std::abs(y), x), std::copysign(1 - std::abs(x), y)};
}

Vec3 normal_at(double x, double y) {
    const double z = 1 - std::abs(x) - std::abs(y);
    if (z < 0) {
        std::tie(x, y) = folded(x, y);
    }
    return scaled_to_one({x, y, z});
}

// Two axes at right angles to a normal (Duff et al., Building an Orthonormal Basis, Revisited,
// 2017).
std::pair<Vec3, Vec3> tangents_of(const Vec3& n) {
    const double sign = std::copysign(1.0, n.z);
    const double a = -1 / (sign + n.z);
    const double b = n.x * n.y * a;
    return {{1 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}};
}

std::uint8_t to_byte(double value) {
    return static_cast<std::uint8_t>(std::lround(value));
}

}  // namespace

PackedFrame::PackedFrame(const LocalFrame& frame) : bytes_(kNone) {
    const Vec3& n = frame.normal;
    const double size = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
    double x = n.x / size;
    double y = n.y / size;
    if (n.z < 0) {
        std::tie(x, y) = folded(x, y);
    }
    bytes_[0] = to_byte(x * kSteps + kSteps);
    bytes_[1] = to_byte(y * kSteps + kSteps);

    // The direction as a point of a diamond's upper half: (1, 0) is 0, (0, 1) half way.
    const auto [first, second] =
        tangents_of(normal_at((bytes_[0] - kSteps) / kSteps, (bytes_[1] - kSteps) / kSteps));
    double along = dot(frame.flattest, first);
    double across = dot(frame.flattest, second);
    if (across < 0) {
        along = -along;
        across = -across;
    }
    const double turn = (1 - along / (std::abs(along) + across)) / 2;
    const auto direction = static_cast<unsigned>(std::lround(turn * kDirections)) % 16U;
    const double flatness = std::clamp(frame.flatness, 1.0, kMostFlatness);
    const auto step =
        static_cast<unsigned>(std::lround((flatness - 1) / (kMostFlatness - 1) * kFlatnesses));
    bytes_[2] = static_cast<std::uint8_t>(direction << 4 | step);
}

LocalFrame PackedFrame::frame() const {
    LocalFrame frame;
    frame.normal = normal_at((bytes_[0] - kSteps) / kSteps, (bytes_[1] - kSteps) / kSteps);
    const auto [first, second] = tangents_of(frame.normal);
    const double along = 1 - 2 * (bytes_[2] >> 4) / kDirections;
    const double across = 1 - std::abs(along);
    const double length = std::sqrt(along * along + across * across);
    const double u = along / length;
    const double v = across / length;
    frame.flattest = {first.x * u + second.x * v, first.y * u + second.y * v,
                      first.z * u + second.z * v};
    frame.steepest = cross(frame.normal, frame.flattest);
    frame.flatness = 1 + (bytes_[2] & 15) * ((kMostFlatness - 1) / kFlatnesses);
    return frame;
}

}  // namespace knap
