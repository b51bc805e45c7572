#include <fmt/format.h>

#include <limits>

#include "knap/error.hpp"
#include "knap/params.hpp"

namespace knap {

void apply_preset(Job& job, std::string_view name) {
    RangeParams range = job.range;
    if (name == "paper") {
        job.curvature = CurvatureParams{};
        range.law = RangeLawKind::kReciprocal;
        range.min_factor = 1.0 / 3;
        range.max_factor = std::numeric_limits<double>::infinity();
        range.slab = 0;
        range.aspect = 1;
        range.repair = 0;
    } else if (name == "accurate") {
        job.curvature = {
            .estimator = Estimator::kQuadric, .neighbours = 20, .discount_noise = true};
        range.law = RangeLawKind::kChord;
        range.min_factor = 0.01;
        range.max_factor = 3;
        range.slab = 0.5;
        range.aspect = 1.3;
        range.repair = 0.3;
    } else {
        throw ConfigError(fmt::format("--preset: expected paper or accurate, found \"{}\"", name));
    }
    job.range = range;
}

}  // namespace knap
