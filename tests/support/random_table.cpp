#include "support/random_table.hpp"

#include <bit>
#include <cmath>

namespace knap::test {

SourceTable random_table(std::mt19937_64& random, bool wide, std::uint64_t most_points) {
    constexpr CoordinateKind kNarrow[] = {CoordinateKind::kFloat32, CoordinateKind::kInt32};
    std::vector<SourceEntry> entries(1 + random() % 4);
    for (SourceEntry& entry : entries) {
        entry.points = 1 + random() % most_points;
        entry.info.coordinates = {
            kNarrow[random() % 2], {0.01, 0.001, 0.25}, {5e5, -4000000.0005, 0.5}};
    }
    if (wide) {
        entries[random() % entries.size()].info.coordinates = {};
    }
    return {entries, {}};
}

Vec3 random_position(std::mt19937_64& random, const SourceTable& table, std::size_t source) {
    const CoordinateFormat& format = table.sources()[source].info.coordinates;
    Vec3 position;
    for (int axis = 0; axis < 3; ++axis) {
        const auto bits = static_cast<std::uint32_t>(random());
        if (format.kind == CoordinateKind::kInt32) {
            position[axis] = format.axis(axis).at(static_cast<std::int32_t>(bits));
        } else if (format.kind == CoordinateKind::kFloat32) {
            const auto value = static_cast<double>(std::bit_cast<float>(bits));
            position[axis] = std::isfinite(value) ? value : 0;
        } else {
            position[axis] = std::uniform_real_distribution<double>(-1e9, 1e9)(random);
        }
    }
    return position;
}

}  // namespace knap::test
