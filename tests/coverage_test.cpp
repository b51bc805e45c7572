#include "merge/coverage.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"

namespace knap {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Ball {
    Vec3 centre;
    double range;
};

bool marked_by_force(const std::vector<Ball>& balls, const Vec3& p) {
    for (const Ball& ball : balls) {
        if (squared_distance(p, ball.centre) <= ball.range * ball.range) {
            return true;
        }
    }
    return false;
}

// Far below what the coordinates resolve, the distance of two points exactly, over the whole box
// and beyond, infinite; and everything between.
double random_range(std::mt19937_64& random, const test::Points& points) {
    const double diagonal = points.box.diagonal() > 0 ? points.box.diagonal() : 1;
    const auto any = [&] { return points.positions[random() % points.positions.size()]; };
    switch (random() % 12) {
        case 0:
            return diagonal *
                   std::pow(10, std::uniform_real_distribution<double>(-300, -10)(random));
        case 1:
            return random() % 20 == 0 ? kInfinity : diagonal * 1e-3;
        case 2:
            return random() % 20 == 0 ? diagonal * (0.5 + static_cast<double>(random() % 8) / 8)
                                      : diagonal * 1e-2;
        case 3:
        case 4: {
            const double distance = std::sqrt(squared_distance(any(), any()));
            return distance > 0 ? distance / 4 : diagonal;
        }
        default:
            return diagonal * std::pow(10, std::uniform_real_distribution<double>(-4, -1)(random));
    }
}

PackedFrame random_frame(std::mt19937_64& random) {
    return random() % 8 == 0
               ? PackedFrame()
               : PackedFrame(PackedFrame::Bytes{static_cast<std::uint8_t>(random() % 255),
                                                static_cast<std::uint8_t>(random() % 255),
                                                static_cast<std::uint8_t>(random() % 256)});
}

TEST(Coverage, EqualsBruteForceForAnyRegions) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> unit(0, 1);
    struct Placed {
        Vec3 centre;
        Region region;
    };
    std::size_t balls = 0;
    std::size_t marked = 0;
    for (int round = 0; round < 1000; ++round) {
        const test::Points points = test::finite_points(test::random_cloud(random));
        if (points.positions.empty()) {
            continue;
        }
        RangeParams range;
        range.slab = random() % 3 == 0 ? 0 : unit(random);
        range.aspect = random() % 3 == 0 ? 1 : 1 + 3 * unit(random);
        const RegionShape shape(range);
        Coverage coverage(points.box, shape);
        std::vector<Placed> placed;
        for (std::size_t i = random() % 40; i > 0; --i) {
            const double r = random_range(random, points);
            const double curvature = std::isfinite(r) ? unit(random) / r : 0;
            const double stretch = std::sqrt(1 + (range.aspect - 1) * unit(random));
            placed.push_back({points.positions[random() % points.positions.size()],
                              {r, r * stretch, curvature, random_frame(random)}});
            coverage.add(placed.back().centre, placed.back().region);
        }
        for (const Vec3& p : points.positions) {
            bool in_ball = false;
            bool inside = false;
            for (const Placed& q : placed) {
                const bool near = squared_distance(p, q.centre) <= q.region.reach * q.region.reach;
                in_ball = in_ball || near;
                inside =
                    inside || (near && (shape.is_ball() || holds(q.region, shape, p - q.centre)));
            }
            ASSERT_EQ(coverage.marks(p), inside) << "round " << round;
            balls += in_ball ? 1 : 0;
            marked += inside ? 1 : 0;
        }
    }
    EXPECT_LT(marked, balls) << "some are in the ball, but not in the region";
    EXPECT_GT(marked, balls / 4);
}

TEST(Coverage, EqualsBruteForceForAnyRanges) {
    std::mt19937_64 random(1);
    std::size_t asked = 0;
    std::size_t marked = 0;
    for (int round = 0; round < 2000; ++round) {
        const test::Points points = test::finite_points(test::random_cloud(random));
        if (points.positions.empty()) {
            continue;
        }
        Coverage coverage(points.box);
        std::vector<Ball> balls;
        const std::size_t count = random() % 60;
        for (std::size_t i = 0; i < count; ++i) {
            balls.push_back({points.positions[random() % points.positions.size()],
                             random_range(random, points)});
            coverage.add(balls.back().centre, balls.back().range);
        }
        ASSERT_EQ(coverage.size(), balls.size());
        for (const Vec3& p : points.positions) {
            ASSERT_EQ(coverage.marks(p), marked_by_force(balls, p)) << "round " << round;
            ++asked;
            marked += coverage.marks(p) ? 1 : 0;
        }
    }
    EXPECT_GT(marked, asked / 5);
    EXPECT_LT(marked, asked * 4 / 5);
}

TEST(Coverage, CountsAPointAtTheRangeExactlyAndNotTheNextDouble) {
    std::mt19937_64 random(2);
    Box box;
    box.extend(Vec3{-100, -100, -100});
    box.extend(Vec3{100, 100, 100});
    for (int round = 0; round < 20000; ++round) {
        const auto coordinate = [&] {
            return std::uniform_real_distribution<double>(-20, 20)(random);
        };
        const Vec3 centre{coordinate(), coordinate(), coordinate()};
        const double range = std::abs(coordinate()) + 1e-3;
        Coverage coverage(box);
        coverage.add(centre, range);
        Vec3 p = centre;
        const int axis = static_cast<int>(random() % 3);
        p[axis] += random() % 2 == 0 ? range : -range;
        for (const double away : {-kInfinity, p[axis], kInfinity}) {
            Vec3 near = p;
            near[axis] = std::nextafter(p[axis], away);
            ASSERT_EQ(coverage.marks(near), marked_by_force({{centre, range}}, near));
        }
    }
}

TEST(Coverage, EqualsBruteForceWhileItGrowsThroughManyBuckets) {
    std::mt19937_64 random(3);
    const test::Points points = test::finite_points(test::sphere_cloud(12000, 3));
    Coverage coverage(points.box);
    std::vector<Ball> balls;
    std::size_t marked = 0;
    for (std::size_t i = 0; i < points.positions.size(); ++i) {
        const Vec3& p = points.positions[i];
        // Against all balls now and then, against the coverage's own answer otherwise.
        if (i % 16 == 0) {
            ASSERT_EQ(coverage.marks(p), marked_by_force(balls, p));
            marked += coverage.marks(p) ? 1 : 0;
        }
        balls.push_back({p, 0.005 * static_cast<double>(1 + random() % 3)});
        coverage.add(balls.back().centre, balls.back().range);
    }
    EXPECT_GT(marked, 0U);
    EXPECT_LT(marked, points.positions.size() / 16);
}

TEST(Coverage, TakesMemoryByTheBallNotByItsRange) {
    const test::Points points = test::finite_points(test::sphere_cloud(1000, 3));
    for (const double range : {1e-300, 1e-20, 1e-17, 1e-12, 1e-3, 0.5, 10.0, kInfinity}) {
        Coverage coverage(points.box);
        for (const Vec3& p : points.positions) {
            coverage.add(p, range);
        }
        // A block of 64 bytes for each of at most eight cells, at most twice that as it grows, and
        // the first buckets of a level.
        EXPECT_LE(coverage.memory_bytes(), 1000U * 8 * 64 * 2 + (1U << 17)) << "range " << range;
    }
}

TEST(Coverage, OfNothingMarksNothing) {
    Box box;
    box.extend(Vec3{0, 0, 0});
    const Coverage coverage(box);
    EXPECT_FALSE(coverage.marks({0, 0, 0}));
    EXPECT_EQ(coverage.size(), 0U);
}

}  // namespace
}  // namespace knap
