#include "evaluate/evaluate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "surface/fan_surface.hpp"
#ifdef KNAP_HAVE_CGAL
#include "evaluate/front_mesh.hpp"
#endif
#include "knap/error.hpp"
#include "support/clouds.hpp"
#include "support/emit_fixture.hpp"

namespace knap {
namespace {

double uniform(std::mt19937_64& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

// Points of a sheet z = height(x, y) over the unit square, at random but evenly.
template <typename Height>
std::vector<Vec3> sheet(std::mt19937_64& random, int side, const Height& height) {
    std::vector<Vec3> points;
    for (int i = 0; i < side; ++i) {
        for (int j = 0; j < side; ++j) {
            const double x = (i + uniform(random, 0.1, 0.9)) / side;
            const double y = (j + uniform(random, 0.1, 0.9)) / side;
            points.push_back({x, y, height(x, y)});
        }
    }
    return points;
}

TEST(FanSurface, OfAPlaneIsThePlaneAndEndsWhereItsPointsEnd) {
    std::mt19937_64 random(1);
    const FanSurface plane(sheet(random, 40, [](double x, double y) { return 0.3 * x - y; }));
    const double steepness = std::sqrt(1 + 0.3 * 0.3 + 1);
    for (int round = 0; round < 2000; ++round) {
        const double x = uniform(random, 0.1, 0.9);
        const double y = uniform(random, 0.1, 0.9);
        const double off = uniform(random, -0.05, 0.05);
        ASSERT_NEAR(plane.nearest({x, y, 0.3 * x - y + off * steepness}).distance, std::abs(off),
                    1e-12);
    }
    EXPECT_NEAR(plane.nearest({3, 0.5, 0.4}).distance, 2.0, 0.15) << "nothing out there";
    EXPECT_TRUE(std::isnan(plane.area()));
}

TEST(FanSurface, OfASphereIsBelowItByTheSagittaOfItsFacets) {
    std::mt19937_64 random(2);
    std::normal_distribution<double> normal;
    const auto on_sphere = [&] {
        const Vec3 p{normal(random), normal(random), normal(random)};
        const double r = std::sqrt(squared_distance(p, {}));
        return Vec3{p.x / r, p.y / r, p.z / r};
    };
    std::vector<Vec3> points(5000);
    std::generate(points.begin(), points.end(), on_sphere);
    const FanSurface sphere(points);
    double sum = 0;
    double most = 0;
    for (int round = 0; round < 5000; ++round) {
        const double d = sphere.nearest(on_sphere()).distance;
        sum += d;
        most = std::max(most, d);
    }
    // A facet with a circumcircle of radius r is at most r^2 / 2 below the sphere. Circles round a
    // random place that hold 1 and 15 of n random points, on average:
    const double one_point = 4.0 / 5000;
    EXPECT_GT(sum / 5000, one_point / 4);
    EXPECT_LT(sum / 5000, one_point * 2);
    EXPECT_LT(most, 15 * one_point / 2);
    for (const Vec3& p : points) {
        ASSERT_EQ(sphere.nearest(p).distance, 0);
    }
}

TEST(FanSurface, OfFewPointsIsAPointOrASegmentOrATriangle) {
    EXPECT_EQ(FanSurface({{1, 0, 0}}).nearest({1, 2, 0}).distance, 2);
    EXPECT_EQ(FanSurface({{0, 0, 0}, {1, 0, 0}}).nearest({0, 2, 0}).distance, 2);
    const FanSurface triangle({{0, 0, 0}, {4, 0, 0}, {0, 4, 0}});
    EXPECT_NEAR(triangle.nearest({1, 1, 3}).distance, 3, 1e-12);
    EXPECT_THROW(FanSurface(std::vector<Vec3>{}), ConfigError);
}

TEST(Evaluate, StreamsAnyNumberOfFilesWithAnyNumberOfThreads) {
    std::mt19937_64 random(3);
    const test::TemporaryFolder folder;
    const auto wave = [](double x, double y) { return 0.1 * std::sin(9 * x) * std::cos(7 * y); };
    std::vector<Vec3> cloud = sheet(random, 200, wave);
    cloud[77].y = std::numeric_limits<double>::infinity();
    test::write_ply(folder / "a.ply", {cloud.begin(), cloud.begin() + 15000});
    test::write_ply(folder / "b.ply", {cloud.begin() + 15000, cloud.end()});
    const FanSurface surface(sheet(random, 30, wave));
    DeviationSum sum;
    Box box;
    for (const Vec3& p : cloud) {
        if (is_finite(p)) {
            sum.add(surface.nearest(p));
            box.extend(p);
        }
    }
    const Deviation expected = sum.result(surface.area());
    for (const int threads : {1, 3}) {
        std::atomic<std::uint64_t> told{0};
        const Evaluation found = evaluate({folder / "a.ply", folder / "b.ply"}, surface, threads,
                                          [&](std::uint64_t points) { told += points; });
        EXPECT_EQ(told, cloud.size());
        EXPECT_EQ(found.deviation.points, cloud.size() - 1);
        EXPECT_EQ(found.deviation.mean, expected.mean);
        EXPECT_EQ(found.deviation.rms, expected.rms);
        EXPECT_EQ(found.deviation.p99, expected.p99);
        EXPECT_EQ(found.deviation.max, expected.max);
        EXPECT_EQ(found.box, box);
    }
}

class SimplifiedPoints : public test::EmitFixture {};

TEST_F(SimplifiedPoints, AreThoseOfAnArchiveOrAFileEachPlaceOnce) {
    const Archive archive(make_archive());
    std::vector<Vec3> expected = test::sorted(tile_points(archive));
    expected.erase(std::unique(expected.begin(), expected.end()), expected.end());
    EXPECT_EQ(simplified_points(folder_ / "archive"), expected);
    EXPECT_EQ(simplified_points(folder_ / "in0.ply").size(), 30000U);
    EXPECT_THROW(simplified_points(folder_ / "none"), InputError);
}

#ifdef KNAP_HAVE_CGAL

TEST(FrontMesh, AgreesWithFansOnAnEvenSheet) {
    std::mt19937_64 random(4);
    const auto wave = [](double x, double y) { return 0.1 * std::sin(9 * x) * std::cos(7 * y); };
    const std::vector<Vec3> kept = sheet(random, 40, wave);
    const FanSurface fans(kept);
    const FrontMesh mesh(kept);
    EXPECT_GT(mesh.facets(), 2500U);
    DeviationSum by_fans;
    DeviationSum by_mesh;
    double plane_squares = 0;
    for (int i = 0; i < 20000; ++i) {
        const double x = uniform(random, 0.1, 0.9);
        const double y = uniform(random, 0.1, 0.9);
        const Vec3 p{x, y, wave(x, y)};
        by_fans.add(fans.nearest(p));
        const Surface::Nearest nearest = mesh.nearest(p);
        by_mesh.add(nearest);
        ASSERT_LE(std::abs(nearest.to_plane), nearest.distance + 1e-12);
        plane_squares += nearest.to_plane * nearest.to_plane;
    }
    const Deviation a = by_fans.result(fans.area());
    const Deviation b = by_mesh.result(mesh.area());
    EXPECT_NEAR(a.mean / b.mean, 1, 0.03);
    EXPECT_NEAR(a.rms / b.rms, 1, 0.03);
    EXPECT_NEAR(b.facet_d, plane_squares / mesh.area(), 1e-9 * b.facet_d);
    EXPECT_GT(mesh.area(), 1.0) << "the sheet is a unit square, but bent";
    EXPECT_LT(mesh.area(), 1.3);
}

TEST(FrontMesh, DoesNotDependOnTheUnit) {
    std::mt19937_64 random(5);
    const auto wave = [](double x, double y) { return 0.1 * std::sin(9 * x) * std::cos(7 * y); };
    std::vector<Vec3> kept = sheet(random, 20, wave);
    const FrontMesh one(kept);
    const double expected = one.nearest({0.5, 0.5, 0.3}).distance;
    for (Vec3& p : kept) {
        p = {std::ldexp(p.x, -30), std::ldexp(p.y, -30), std::ldexp(p.z, -30)};
    }
    const FrontMesh small(kept);
    const Vec3 p{std::ldexp(0.5, -30), std::ldexp(0.5, -30), std::ldexp(0.3, -30)};
    EXPECT_NEAR(std::ldexp(small.nearest(p).distance, 30), expected, 1e-9);
    EXPECT_NEAR(std::ldexp(small.area(), 60), one.area(), 1e-9);
}

TEST(FrontMesh, OfPointsWithoutASurfaceIsAnError) {
    EXPECT_THROW(FrontMesh(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}}), ConfigError);
}

#endif

}  // namespace
}  // namespace knap
