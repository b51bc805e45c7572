#include "emit/lattice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "knap/error.hpp"

namespace knap {

namespace {

// Tiles hold coordinates as floats: steps outside would leave their range within 2^20 steps.
constexpr double kSmallestStep = 1e-30;
constexpr double kLargestStep = 1e30;

// A grid is common if it fits to a thousandth of a step: far less than half a step, by which the
// coordinates would begin to differ, far more than the rounding of large offsets.
constexpr double kGridTolerance = 1e-3;

// Scales are decimal fractions with a rounding error each.
constexpr double kScaleTolerance = 1e-9;

bool is_whole(double value, double tolerance) {
    return std::abs(value - std::round(value)) <= tolerance;
}

/// The grid that every coordinate of every source lies on, if all store integers.
std::optional<Lattice> common_grid(const SourceTable& sources) {
    double scale = std::numeric_limits<double>::infinity();
    for (const SourceEntry& source : sources.sources()) {
        const CoordinateFormat& format = source.info.coordinates;
        if (format.kind != CoordinateKind::kInt32) {
            return std::nullopt;
        }
        scale = std::min({scale, format.scale.x, format.scale.y, format.scale.z});
    }
    if (!(scale >= kSmallestStep) || !(scale <= kLargestStep)) {
        return std::nullopt;
    }
    Lattice grid{sources.sources().front().info.coordinates.offset, scale};
    for (int axis = 0; axis < 3; ++axis) {
        // Then positions are whole steps from zero, as their readers evaluate them.
        if (GridAxis(scale, grid.origin[axis]).whole()) {
            grid.origin[axis] = 0;
        }
    }
    for (const SourceEntry& source : sources.sources()) {
        const CoordinateFormat& format = source.info.coordinates;
        for (int axis = 0; axis < 3; ++axis) {
            const double ratio = format.scale[axis] / scale;
            const double shift = (format.offset[axis] - grid.origin[axis]) / scale;
            if (!is_whole(ratio, kScaleTolerance * ratio) || !is_whole(shift, kGridTolerance)) {
                return std::nullopt;
            }
        }
    }
    return grid;
}

/// Largest power of two <= value.
double power_of_two_below(double value) {
    return std::ldexp(1.0, std::ilogb(std::clamp(value, 2 * kSmallestStep, kLargestStep)));
}

double default_step(const Box& box, double spacing) {
    if (spacing > 0 && std::isfinite(spacing)) {
        return power_of_two_below(spacing / 64);
    }
    const double diagonal = box.diagonal();
    return diagonal > 0 && std::isfinite(diagonal) ? power_of_two_below(diagonal / 65536) : 1.0;
}

/// A multiple of the step at or below the box, so that neighbouring jobs share a lattice; the
/// point itself where the box is only one.
Vec3 corner_of(const Box& box, double step) {
    if (box.empty() || box.min == box.max) {
        return box.empty() ? Vec3{} : box.min;
    }
    return {std::floor(box.min.x / step) * step, std::floor(box.min.y / step) * step,
            std::floor(box.min.z / step) * step};
}

void check(const Lattice& lattice, const Box& box) {
    if (!(lattice.step >= kSmallestStep) || !(lattice.step <= kLargestStep)) {
        throw ConfigError(fmt::format("output.step (--step): expected {} .. {}, found {}",
                                      kSmallestStep, kLargestStep, lattice.step));
    }
    for (int axis = 0; axis < 3 && !box.empty(); ++axis) {
        const double low = (box.min[axis] - lattice.origin[axis]) / lattice.step;
        const double high = (box.max[axis] - lattice.origin[axis]) / lattice.step;
        const double largest = std::max(std::abs(low), std::abs(high));
        if (!(largest < static_cast<double>(kLargestLatticeIndex))) {
            throw ConfigError(fmt::format(
                "output.step (--step): expected a step that cuts the box ({} .. {} along {}) into "
                "fewer than 2^52 parts, found {}",
                box.min[axis], box.max[axis], "xyz"[axis], lattice.step));
        }
    }
}

}  // namespace

Lattice choose_lattice(double step, const SourceTable& sources, double spacing) {
    const Box& box = sources.box();
    const std::optional<Lattice> grid = common_grid(sources);
    Lattice lattice;
    if (step > 0) {
        lattice.step = step;
    } else {
        lattice.step = grid ? grid->step : default_step(box, spacing);
    }
    lattice.origin = grid ? grid->origin : corner_of(box, lattice.step);
    check(lattice, box);
    return lattice;
}

}  // namespace knap
