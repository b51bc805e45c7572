#include "tileset/frame.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "knap/error.hpp"

namespace knap {

namespace {

constexpr std::size_t kGrid = 5;
// A box without extent along an axis still needs that axis. Over a metre the Earth is flat to a
// tenth of a micrometre, and the rounding of places on it (1e-9 m) is nothing.
constexpr double kThinnest = 1;  // metres

double dot(const Vec3& a, const Vec3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Vec3 times(const Vec3& v, double factor) {
    return {v.x * factor, v.y * factor, v.z * factor};
}
Vec3 unit(const Vec3& v) {
    return times(v, 1 / std::sqrt(dot(v, v)));
}

/// The axes at right angles that are nearest to three others, by Newton's iteration for the polar
/// decomposition: R <- (R + R^-T) / 2. The columns of R^-T are cross products over the determinant.
std::array<Vec3, 3> right_angled(std::array<Vec3, 3> axes) {
    constexpr int kSteps = 8;  // converges quadratically from nearly right angles
    for (Vec3& axis : axes) {
        axis = unit(axis);
    }
    for (int step = 0; step < kSteps; ++step) {
        const std::array<Vec3, 3> normals{cross(axes[1], axes[2]), cross(axes[2], axes[0]),
                                          cross(axes[0], axes[1])};
        const double determinant = dot(axes[0], normals[0]);
        for (std::size_t i = 0; i < 3; ++i) {
            axes[i] = times(axes[i] + times(normals[i], 1 / determinant), 0.5);
        }
    }
    return axes;
}

struct Sample {
    Vec3 offset;  // from the middle of the box, cloud units
    Vec3 place;
};

/// Metres a cloud unit along an axis, roughly.
double metres(const Vec3& at, int axis, const Geocentric& earth) {
    constexpr double kStep = 1e-4;
    Vec3 next = at;
    next[axis] += kStep;
    return std::sqrt(squared_distance(earth.at(at), earth.at(next))) / kStep;
}

std::vector<Sample> sample(const Vec3& middle, const Vec3& half, const Geocentric& earth) {
    std::vector<Sample> samples;
    samples.reserve(kGrid * kGrid * kGrid);
    const auto at = [](std::size_t i) { return 2.0 * static_cast<double>(i) / (kGrid - 1) - 1; };
    for (std::size_t i = 0; i < kGrid; ++i) {
        for (std::size_t j = 0; j < kGrid; ++j) {
            for (std::size_t k = 0; k < kGrid; ++k) {
                const Vec3 offset{at(i) * half.x, at(j) * half.y, at(k) * half.z};
                const Vec3 place = earth.at(middle + offset);
                if (!is_finite(place)) {
                    const Vec3 p = middle + offset;
                    throw InputError(
                        fmt::format("({}, {}, {}) is no place on the Earth in its coordinate "
                                    "system",
                                    p.x, p.y, p.z));
                }
                samples.push_back({offset, place});
            }
        }
    }
    return samples;
}

}  // namespace

Frame local_frame(const Vec3& origin) {
    Frame frame;
    frame.origin = origin;
    frame.place = origin;
    return frame;
}

Frame fit_frame(const Box& box, const Vec3& origin, const Geocentric& earth) {
    const Vec3 size = box.size();
    const Vec3 middle = box.min + times(size, 0.5);
    Vec3 half;
    for (int axis = 0; axis < 3; ++axis) {
        half[axis] = std::max(size[axis], kThinnest / metres(middle, axis, earth)) / 2;
    }
    const std::vector<Sample> samples = sample(middle, half, earth);

    // The grid is symmetric, so that the slope along each axis is found alone.
    const Vec3 about = samples.front().place;  // sums of small numbers
    Vec3 mean;
    std::array<Vec3, 3> slopes{};
    Vec3 squares;
    for (const Sample& s : samples) {
        mean = mean + (s.place - about);
        for (int axis = 0; axis < 3; ++axis) {
            Vec3& slope = slopes[static_cast<std::size_t>(axis)];
            slope = slope + times(s.place - about, s.offset[axis]);
            squares[axis] += s.offset[axis] * s.offset[axis];
        }
    }
    mean = about + times(mean, 1.0 / static_cast<double>(samples.size()));
    Frame frame;
    frame.origin = origin;
    for (int axis = 0; axis < 3; ++axis) {
        auto& slope = slopes[static_cast<std::size_t>(axis)];
        slope = times(slope, 1 / squares[axis]);
    }
    frame.axes = right_angled(slopes);
    frame.place = mean;
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<std::size_t>(axis);
        frame.scale[axis] = dot(slopes[i], frame.axes[i]);
        frame.place =
            frame.place + times(frame.axes[i], frame.scale[axis] * (origin - middle)[axis]);
    }
    for (const Sample& s : samples) {
        const Vec3 seen = seen_from(frame, s.place);
        const Vec3 p = middle + s.offset - origin;
        const Vec3 off{seen.x - frame.scale.x * p.x, seen.y - frame.scale.y * p.y,
                       seen.z - frame.scale.z * p.z};
        frame.error = std::max(frame.error, std::sqrt(dot(off, off)));
    }
    return frame;
}

Vec3 seen_from(const Frame& frame, const Vec3& place) {
    const Vec3 offset = place - frame.place;
    return {dot(offset, frame.axes[0]), dot(offset, frame.axes[1]), dot(offset, frame.axes[2])};
}

Matrix matrix_of(const Frame& frame, const Vec3& stretch) {
    Matrix matrix{};
    for (std::size_t row = 0; row < 3; ++row) {
        const int coordinate = static_cast<int>(row);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            matrix[4 * axis + row] = frame.axes[axis][coordinate] * stretch[static_cast<int>(axis)];
        }
        matrix[12 + row] = frame.place[coordinate];
    }
    matrix[15] = 1;
    return matrix;
}

Matrix relative_to(const Matrix& outer, const Matrix& inner) {
    // The inverse of axes at right angles is their transpose over the squares of their lengths.
    const auto column = [](const Matrix& matrix, std::size_t i) {
        return Vec3{matrix[4 * i], matrix[4 * i + 1], matrix[4 * i + 2]};
    };
    Matrix result{};
    for (std::size_t i = 0; i < 4; ++i) {
        const Vec3 v = i < 3 ? column(inner, i) : column(inner, 3) - column(outer, 3);
        for (std::size_t row = 0; row < 3; ++row) {
            const Vec3 axis = column(outer, row);
            result[4 * i + row] = dot(axis, v) / dot(axis, axis);
        }
    }
    result[15] = 1;
    return result;
}

}  // namespace knap
