#include "support/random_params.hpp"

#include <cmath>
#include <limits>

namespace knap::test {

SimplifyParams random_params(std::mt19937_64& random, const std::vector<Vec3>& cloud) {
    const auto uniform = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    const auto pick = [&](int low, int high) {
        return std::uniform_int_distribution<int>(low, high)(random);
    };
    Box box;
    for (const Vec3& p : cloud) {
        if (is_finite(p)) {
            box.extend(p);
        }
    }
    const double diagonal = box.empty() ? 0 : box.diagonal();
    SimplifyParams params;
    params.curvature.estimator = pick(0, 2) == 0 ? Estimator::kQuadric : Estimator::kFourier;
    params.curvature.discount_noise =
        params.curvature.estimator == Estimator::kQuadric && pick(0, 1) == 0;
    params.range.law = pick(0, 2) == 0 ? RangeLawKind::kChord : RangeLawKind::kReciprocal;
    params.curvature.neighbours = pick(0, 1) == 0 ? 30 : pick(3, 60);
    params.curvature.samples = pick(0, 2) == 0 ? 2 * pick(2, 12) : 8;
    params.curvature.step = pick(0, 2) == 0 ? uniform(0.2, 2) : 0.8;
    // A lattice step as alpha makes distances equal ranges.
    params.range.alpha = pick(0, 3) == 0 ? 0.1
                         : diagonal > 0  ? diagonal * std::pow(10, uniform(-3, -0.5))
                                         : 1;
    params.range.min_factor = pick(0, 1) == 0 ? 1.0 / 3 : uniform(0.01, 1);
    params.range.max_factor = pick(0, 2) == 0   ? std::numeric_limits<double>::infinity()
                              : pick(0, 1) == 0 ? 8
                                                : uniform(1, 20);
    if (pick(0, 2) == 0) {
        params.range.slab = uniform(0.02, 1);
    }
    if (params.curvature.estimator == Estimator::kQuadric && pick(0, 1) == 0) {
        params.range.aspect = uniform(1, 4);
    }
    if (pick(0, 3) == 0) {
        params.range.repair = uniform(0.01, 0.7);
    }
    if (params.range.law == RangeLawKind::kChord &&
        params.curvature.estimator == Estimator::kQuadric && diagonal > 0 && pick(0, 1) == 0) {
        params.range.alpha = 0;
        params.range.tolerance = diagonal * std::pow(10, uniform(-5, -1));
    }
    params.threads = pick(1, 3);
    return params;
}

}  // namespace knap::test
