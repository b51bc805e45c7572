#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "curvature/estimator.hpp"
#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"
#include "support/reference.hpp"

namespace knap {
namespace {

double uniform(std::mt19937_64& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

// A point and its neighbours by (distance, id) in a random cloud.
std::vector<Vec3> random_neighbourhood(std::mt19937_64& random) {
    test::Points points;
    while (points.positions.empty()) {
        points = test::distinct_points(test::random_cloud(random));
    }
    const std::size_t at = random() % points.positions.size();
    std::vector<Vec3> neighbourhood{points.positions[at]};
    for (const test::Found& found :
         test::nearest_by_force(points, points.positions[at], points.ids[at], 3 + random() % 60)) {
        const auto place = std::lower_bound(points.ids.begin(), points.ids.end(), found.id);
        neighbourhood.push_back(
            points.positions[static_cast<std::size_t>(place - points.ids.begin())]);
    }
    return neighbourhood;
}

double spacing_of(const std::vector<Vec3>& neighbourhood) {
    return neighbourhood.size() < 2
               ? 1
               : std::sqrt(squared_distance(neighbourhood[0], neighbourhood[1]));
}

CurvatureParams random_params(std::mt19937_64& random) {
    CurvatureParams params;
    params.samples = random() % 3 == 0 ? 8 : static_cast<int>(2 * (2 + random() % 31));
    params.step = random() % 2 == 0 ? 0.8 : uniform(random, 0.1, 3);
    return params;
}

// The weight of sample l in f''(0), for a step of 1.
double second_weight(int samples, int l) {
    double sum = 0;
    for (int n = 1; n < samples / 2; ++n) {
        sum += n * n * std::cos(2 * std::numbers::pi * n * (l - samples / 2) / samples);
    }
    return -2.0 / samples * std::pow(2 * std::numbers::pi / samples, 2) * sum;
}

// Smallest gap of the eigenvalues over the largest one: how well the frame is determined.
double separation(const std::vector<Vec3>& points) {
    Eigen::MatrixXd rows(std::ssize(points), 3);
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        const Vec3& p = points[static_cast<std::size_t>(i)];
        rows.row(i) << p.x - points[0].x, p.y - points[0].y, p.z - points[0].z;
    }
    const Eigen::MatrixXd centred = rows.rowwise() - rows.colwise().mean();
    const Eigen::Vector3d l =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(centred.transpose() * centred).eigenvalues();
    return std::min(l[1] - l[0], l[2] - l[1]) / l[2];
}

TEST(Fourier, EqualsTheMethodWrittenDownLiterally) {
    std::mt19937_64 random(1);
    int compared = 0;
    for (int round = 0; round < 4000; ++round) {
        std::vector<Vec3> points(4 + random() % 60);
        const double thickness = uniform(random, 0.01, 1);
        for (Vec3& p : points) {
            p = {uniform(random, -1, 1), uniform(random, -0.7, 0.7),
                 thickness * uniform(random, -0.4, 0.4)};
        }
        // Rounding turns the frame by about 1e-16 over the gap of the eigenvalues.
        if (separation(points) < 1e-3) {
            continue;
        }
        const CurvatureParams params = random_params(random);
        const double spacing = uniform(random, 0.05, 0.3);
        const double expected = reference::curvature(points, params, spacing);
        const double h = CurvatureEstimator(params, spacing).mean_curvature(points);
        // Both curvatures are sums that may cancel; a height over a step squared is their scale.
        const double scale = 1 / (params.step * spacing);
        ASSERT_NEAR(h, expected, 1e-9 * (expected + scale)) << "round " << round;
        ++compared;
    }
    EXPECT_GT(compared, 3000);
}

// On a sphere of radius R, sampled at the estimator's own places, heights are u^2 / 2R. The
// transform of u^2 has the coefficients a_n = (-1)^n / sin^2(pi n / N), in steps, so the truncated
// series answers 1/R with a constant that depends on N only (2.89 for N = 8).
double response(int samples) {
    double sum = 0;
    for (int n = 1; n < samples / 2; ++n) {
        const double s = std::sin(std::numbers::pi * n / samples);
        sum += (n % 2 == 0 ? 1 : -1) * n * n / (s * s);
    }
    return std::abs(std::pow(2 * std::numbers::pi / samples, 2) * sum / 2);
}

TEST(Fourier, OfASphereIsTheResponseOfTheTruncatedSeriesOverItsRadius) {
    std::mt19937_64 random(2);
    for (int round = 0; round < 300; ++round) {
        const int samples = static_cast<int>(2 * (2 + random() % 7));
        const double step = uniform(random, 0.01, 100);
        const double radius = step * 1e7;
        const auto height = [&](double u) {
            return u * u / (radius + std::sqrt(radius * radius - u * u));
        };
        std::vector<Eigen::Vector3d> places;
        for (int k = 1; k <= samples / 2 + 2; ++k) {
            for (const double u : {k * step, -k * step}) {
                places.emplace_back(u, 0, height(u));
                // Two fewer on one axis: the frame is then determined.
                if (k <= samples / 2) {
                    places.emplace_back(0, u, height(u));
                }
            }
        }
        const Eigen::Quaterniond turn =
            Eigen::Quaterniond(uniform(random, -1, 1), uniform(random, -1, 1),
                               uniform(random, -1, 1), uniform(random, -1, 1))
                .normalized();
        std::vector<Vec3> points{{0, 0, 0}};
        for (const Eigen::Vector3d& place : places) {
            const Eigen::Vector3d p = turn * place;
            points.push_back({p.x(), p.y(), p.z()});
        }
        CurvatureParams params;
        params.samples = samples;
        params.step = 1;
        const double h = CurvatureEstimator(params, step).mean_curvature(points);
        // A sample takes the point at its place with the inverse of its height as the weight, and
        // up to three others, a step or more away, with one over the step at most: it is off by
        // 3 z z_max / step. Rounding adds 16 epsilon of the neighbourhood's reach.
        const double reach = (samples / 2 + 2) * step;
        double tolerance = 0;
        for (int l = 0; l < samples; ++l) {
            const double z = height((l - samples / 2) * step);
            const double off = 3 * z * height(reach) / step + 16 * 2.2e-16 * reach;
            tolerance += std::abs(second_weight(samples, l)) / (step * step) * off;
        }
        ASSERT_LT(tolerance, 0.05 * response(samples) / radius) << "the test says something";
        ASSERT_NEAR(h, response(samples) / radius, tolerance) << samples << " samples";
    }
    EXPECT_NEAR(response(8), 2.89, 0.005);
}

TEST(Fourier, OfAPlaneIsZero) {
    std::mt19937_64 random(3);
    for (int round = 0; round < 500; ++round) {
        std::vector<Vec3> points;
        const double slope_x = round % 5 == 0 ? 0 : uniform(random, -2, 2);
        const double slope_y = round % 5 == 0 ? 0 : uniform(random, -2, 2);
        for (std::size_t i = 0; i < 30; ++i) {
            const double x = uniform(random, -1, 1);
            const double y = uniform(random, -1, 1);
            points.push_back({x, y, slope_x * x + slope_y * y});
        }
        const CurvatureParams params = random_params(random);
        const double spacing = uniform(random, 0.05, 0.3);
        const double step = params.step * spacing;
        // Heights are zero but for the rounding of points at most 5 away and of their frame.
        double tolerance = 0;
        for (int l = 0; l < params.samples; ++l) {
            tolerance +=
                std::abs(second_weight(params.samples, l)) / (step * step) * 64 * 2.2e-16 * 5;
        }
        const double h = CurvatureEstimator(params, spacing).mean_curvature(points);
        ASSERT_LE(h, round % 5 == 0 ? 0 : tolerance) << "round " << round;
    }
}

TEST(Fourier, ScalesWithOneOverTheCloud) {
    std::mt19937_64 random(4);
    for (int round = 0; round < 2000; ++round) {
        std::vector<Vec3> points = random_neighbourhood(random);
        const double spacing = spacing_of(points);
        const CurvatureParams params = random_params(random);
        const double h = CurvatureEstimator(params, spacing).mean_curvature(points);
        // A power of two scales without rounding: bit for bit.
        const int exponent = static_cast<int>(random() % 60) - 30;
        for (Vec3& p : points) {
            p = {std::ldexp(p.x, exponent), std::ldexp(p.y, exponent), std::ldexp(p.z, exponent)};
        }
        const double scaled =
            CurvatureEstimator(params, std::ldexp(spacing, exponent)).mean_curvature(points);
        ASSERT_EQ(scaled, std::ldexp(h, -exponent)) << "round " << round;
    }
}

TEST(Fourier, DoesNotDependOnWhereTheCloudLies) {
    std::mt19937_64 random(5);
    for (int round = 0; round < 2000; ++round) {
        // On a lattice of 2^-20, so that moving by whole numbers rounds nothing.
        std::vector<Vec3> points(4 + random() % 40);
        for (Vec3& p : points) {
            for (int axis = 0; axis < 3; ++axis) {
                p[axis] = std::ldexp(static_cast<double>(random() % (1 << 20)), -20);
            }
        }
        const CurvatureParams params = random_params(random);
        const CurvatureEstimator estimator(params, 0.1);
        const double h = estimator.mean_curvature(points);
        const Vec3 away{static_cast<double>(random() % 10000000), -4e6, 123};
        for (Vec3& p : points) {
            p = p + away;
        }
        ASSERT_EQ(estimator.mean_curvature(points), h);
    }
}

TEST(Fourier, IsFiniteAndNotNegativeForAnyNeighbourhood) {
    std::mt19937_64 random(6);
    for (int round = 0; round < 5000; ++round) {
        const std::vector<Vec3> points = random_neighbourhood(random);
        const double spacing = spacing_of(points) * std::pow(10, uniform(random, -6, 6));
        const double h = CurvatureEstimator(random_params(random), spacing).mean_curvature(points);
        ASSERT_TRUE(std::isfinite(h));
        ASSERT_GE(h, 0);
    }
}

TEST(Fourier, WithoutFourPointsExtentOrSpacingIsZero) {
    const std::vector<Vec3> bent{
        {0, 0, 0}, {1, 0, 0.5}, {-1, 0, 0.5}, {0, 1.5, 0.5}, {0, -1.5, 0.5}};
    const CurvatureEstimator estimator({}, 0.5);
    EXPECT_GT(estimator.mean_curvature(bent), 0);
    for (std::size_t size = 0; size < 4; ++size) {
        EXPECT_EQ(estimator.mean_curvature(std::span(bent).first(size)), 0);
    }
    const std::vector<Vec3> one_place(20, Vec3{1e6, 2e6, 3e6});
    EXPECT_EQ(estimator.mean_curvature(one_place), 0);
    EXPECT_EQ(CurvatureEstimator({}, 0).mean_curvature(bent), 0);
}

}  // namespace
}  // namespace knap
