#include "repair/violators.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "surface/fan_surface.hpp"

namespace knap {
namespace {

std::vector<RankedPoint> random_sheet(std::mt19937_64& random, std::size_t count, PointId first) {
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<RankedPoint> points;
    for (std::size_t i = 0; i < count; ++i) {
        const double x = unit(random);
        const double y = unit(random);
        points.push_back({0, first + i, {x, y, 0.2 * x * y + 0.02 * unit(random)}});
    }
    return points;
}

TEST(Violators, AreThoseFartherFromTheWholeSurfaceHoweverLittleOfItIsLookedAtFirst) {
    std::mt19937_64 random(4);
    for (int round = 0; round < 40; ++round) {
        const std::vector<RankedPoint> kept = random_sheet(random, 50 + random() % 400, 0);
        const std::vector<RankedPoint> points = random_sheet(random, 1 + random() % 500, 1000);
        const double farthest = std::uniform_real_distribution<double>(0.1, 1.5)(random);
        const double limit = std::uniform_real_distribution<double>(0, 0.01)(random);
        std::vector<Vec3> positions;
        std::vector<PointId> ids;
        for (const RankedPoint& point : kept) {
            positions.push_back(point.position);
            ids.push_back(point.id);
        }
        const FanSurface whole(positions, ids, farthest);
        std::vector<RankedPoint> expected;
        for (const RankedPoint& point : points) {
            const double distance = whole.nearest(point.position).distance;
            if (distance > limit) {
                expected.push_back({distance, point.id, point.position});
            }
        }
        std::sort(expected.begin(), expected.end(),
                  [](const auto& a, const auto& b) { return ranks_before(a, b); });
        for (const double radius : {0.01, 0.1, 3.0}) {
            const std::vector<RankedPoint> found = find_violators(
                points, {.distance = limit, .farthest = farthest, .radius = radius},
                [&](const Box& box, double within) {
                    std::vector<RankedPoint> near;
                    std::copy_if(kept.begin(), kept.end(), std::back_inserter(near),
                                 [&](const RankedPoint& p) {
                                     return box.squared_distance_to(p.position) <= within * within;
                                 });
                    return near;
                });
            ASSERT_EQ(found.size(), expected.size()) << "round " << round;
            for (std::size_t i = 0; i < found.size(); ++i) {
                ASSERT_EQ(found[i].id, expected[i].id);
                ASSERT_EQ(found[i].key, expected[i].key);
            }
        }
    }
}

}  // namespace
}  // namespace knap
