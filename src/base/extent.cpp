#include "base/extent.hpp"

#include <fmt/format.h>

#include <cmath>

#include "knap/error.hpp"

namespace knap {

void check_extent(const Box& box) {
    if (!box.empty() && !std::isfinite(squared_distance(box.min, box.max))) {
        throw InputError(fmt::format(
            "the input: expected coordinates whose squared distances are finite, found a box from "
            "({:g}, {:g}, {:g}) to ({:g}, {:g}, {:g})",
            box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z));
    }
}

}  // namespace knap
