#include "output/las_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace knap {

namespace {

// As for the lattice of an archive: grids are one if they differ by far less than half a step, and
// by more than the rounding of large offsets.
constexpr double kGridTolerance = 1e-3;
constexpr double kScaleTolerance = 1e-9;
constexpr double kFirstStep = std::numeric_limits<std::int32_t>::min();
constexpr double kLastStep = std::numeric_limits<std::int32_t>::max();

bool is_whole(double value, double tolerance) {
    return std::abs(value - std::round(value)) <= tolerance;
}

struct Axis {
    double scale = 0;
    double offset = 0;
};

bool spans(const Axis& axis, double low, double high) {
    return std::round((low - axis.offset) / axis.scale) >= kFirstStep &&
           std::round((high - axis.offset) / axis.scale) <= kLastStep;
}

/// The grid of one axis that every source's lies on, if there is one and the box fits it.
std::optional<Axis> common_axis(std::span<const CoordinateFormat> sources, int axis, double low,
                                double high) {
    Axis common{std::numeric_limits<double>::infinity(), sources.front().offset[axis]};
    for (const CoordinateFormat& source : sources) {
        if (source.kind != CoordinateKind::kInt32) {
            return std::nullopt;
        }
        common.scale = std::min(common.scale, source.scale[axis]);
    }
    for (const CoordinateFormat& source : sources) {
        const double ratio = source.scale[axis] / common.scale;
        const double shift = (source.offset[axis] - common.offset) / common.scale;
        if (!is_whole(ratio, kScaleTolerance * ratio) || !is_whole(shift, kGridTolerance)) {
            return std::nullopt;
        }
    }
    if (!spans(common, low, high)) {
        const double middle = low + (high - low) / 2;
        const double steps = std::round((middle - common.offset) / common.scale);
        // Evaluated as readers do, so that a whole offset stays whole.
        const double whole = std::round(common.offset / common.scale);
        const bool is_whole_offset = GridAxis(common.scale, common.offset).whole();
        common.offset =
            is_whole_offset ? (whole + steps) * common.scale : common.offset + steps * common.scale;
    }
    return spans(common, low, high) ? std::optional(common) : std::nullopt;
}

Axis stepped_axis(double step, double low, double high) {
    Axis axis{step, std::floor(low / step) * step};
    while (!spans(axis, low, high)) {
        axis.scale *= 2;
        axis.offset = std::floor(low / axis.scale) * axis.scale;
    }
    return axis;
}

}  // namespace

LasGrid choose_las_grid(std::span<const CoordinateFormat> sources, const Box& box, double step) {
    LasGrid grid;
    grid.format.kind = CoordinateKind::kInt32;
    grid.exact = true;
    const bool empty = box.empty();
    for (int i = 0; i < 3; ++i) {
        const double low = empty ? sources.front().offset[i] : box.min[i];
        const double high = empty ? low : box.max[i];
        const std::optional<Axis> common = common_axis(sources, i, low, high);
        const Axis axis = common ? *common : stepped_axis(step, low, high);
        grid.exact = grid.exact && common.has_value();
        grid.format.scale[i] = axis.scale;
        grid.format.offset[i] = axis.offset;
    }
    return grid;
}

std::optional<std::int32_t> GridSteps::at(double coordinate) const {
    const double steps = std::round((coordinate - offset_) / scale_);
    // Written so that NaN fails.
    if (!(steps >= kFirstStep && steps <= kLastStep)) {
        return std::nullopt;
    }
    const auto nearest = static_cast<std::int64_t>(steps);
    // The quotient may round past a half; the place itself tells.
    for (const std::int64_t step : {nearest, nearest - 1, nearest + 1}) {
        if (std::in_range<std::int32_t>(step) &&
            axis_.at(static_cast<std::int32_t>(step)) == coordinate) {
            return static_cast<std::int32_t>(step);
        }
    }
    return static_cast<std::int32_t>(nearest);
}

}  // namespace knap
