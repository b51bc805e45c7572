#include "curvature/neighbourhoods.hpp"

namespace knap {

void Neighbourhoods::resize(std::size_t new_count, std::size_t new_size) {
    count = new_count;
    size = new_size;
    stride = (size + kPadding - 1) / kPadding * kPadding;
    const std::size_t values = count * stride + kPadding;
    if (x.size() < values) {
        for (std::vector<double>* axis : {&x, &y, &z}) {
            axis->resize(values);
        }
    }
    centres.resize(count);
    squared_reaches.resize(count);
}

}  // namespace knap
