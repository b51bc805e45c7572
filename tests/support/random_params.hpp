#pragma once

#include <random>
#include <vector>

#include "knap/simplify.hpp"

namespace knap::test {

/// Random K, samples, step, alpha and factors (infinite too) that suit the size of a cloud.
SimplifyParams random_params(std::mt19937_64& random, const std::vector<Vec3>& cloud);

}  // namespace knap::test
