#include "tileset/placement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "knap/error.hpp"

namespace knap {

namespace {

// CesiumJS takes whole steps of up to 16 bits.
constexpr std::int64_t kMostSteps = (std::int64_t{1} << 16) - 1;
// The frame's error is known on a grid; between its points the surface bends no more than so.
constexpr double kBetween = 1.5;
// Range, step and product are rounded to floats, on three axes: 3 sqrt(3).
constexpr double kRoundings = 5.2;

double longest(const Vec3& v) {
    return std::max({v.x, v.y, v.z});
}

bool fits_steps(const LatticeBounds& region) {
    bool fits = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        fits = fits && region.max[axis] - region.min[axis] <= kMostSteps;
    }
    return fits;
}

}  // namespace

Placement place_tile(const LatticeBounds& region, const Lattice& lattice, const Geocentric* earth) {
    Placement placement;
    placement.lattice = lattice;
    placement.origin = region.min;
    const Vec3 origin = position_of(lattice, region.min);
    const Vec3 far = position_of(lattice, region.max);
    placement.frame =
        earth == nullptr ? local_frame(origin) : fit_frame({origin, far}, origin, *earth);
    const Frame& frame = placement.frame;
    const Vec3& scale = frame.scale;
    const double step = lattice.step * longest(scale);
    placement.whole_steps = fits_steps(region) && frame.error <= step / 2;
    // Steps are alike on all axes; that the axes are not is left to the matrix.
    Vec3 stretch{1, 1, 1};
    placement.unit = scale;
    if (placement.whole_steps) {
        placement.unit = {scale.x, scale.x, scale.x};
        stretch = {1, scale.y / scale.x, scale.z / scale.x};
    }
    placement.matrix = matrix_of(frame, stretch);

    const double extent =
        longest({(far - origin).x * placement.unit.x, (far - origin).y * placement.unit.y,
                 (far - origin).z * placement.unit.z});
    const double rounding = kRoundings * std::ldexp(extent, -24);
    placement.largest_error = (placement.whole_steps ? frame.error : 0) + rounding;
    // Never without thickness: half a step all around.
    for (int axis = 0; axis < 3; ++axis) {
        const double margin =
            lattice.step * placement.unit[axis] / 2 + kBetween * frame.error + rounding;
        placement.box.min[axis] = -margin;
        placement.box.max[axis] = (far - origin)[axis] * placement.unit[axis] + margin;
    }
    return placement;
}

std::array<float, 3> coordinates_of(const Placement& placement, const LatticeIndex& point,
                                    const Geocentric* earth) {
    std::array<float, 3> coordinates{};
    if (earth != nullptr && !placement.whole_steps) {
        const Vec3 position = position_of(placement.lattice, point);
        const Vec3 seen = seen_from(placement.frame, earth->at(position));
        if (!is_finite(seen)) {
            throw InputError(
                fmt::format("({}, {}, {}) is no place on the Earth in its coordinate system",
                            position.x, position.y, position.z));
        }
        return {static_cast<float>(seen.x), static_cast<float>(seen.y), static_cast<float>(seen.z)};
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto steps = static_cast<double>(point[axis] - placement.origin[axis]);
        coordinates[axis] = static_cast<float>(steps * placement.lattice.step *
                                               placement.unit[static_cast<int>(axis)]);
    }
    return coordinates;
}

}  // namespace knap
