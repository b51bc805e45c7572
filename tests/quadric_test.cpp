#include "curvature/quadric.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "base/vector.hpp"
#include "curvature/estimator.hpp"

namespace knap {
namespace {

constexpr CurvatureParams kParams{.estimator = Estimator::kQuadric};

double uniform(std::mt19937_64& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

double estimate(const std::vector<Vec3>& points) {
    return CurvatureEstimator(kParams, 1).mean_curvature(points);
}

Vec3 rotate(const Eigen::Quaterniond& turn, const Vec3& p) {
    const Eigen::Vector3d q = turn * Eigen::Vector3d(p.x, p.y, p.z);
    return {q.x(), q.y(), q.z()};
}

Eigen::Quaterniond random_turn(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
        .normalized();
}

// A patch of about unit extent round its first point, which lies at its origin.
template <typename Height>
std::vector<Vec3> patch(std::mt19937_64& random, std::size_t size, const Height& height) {
    std::vector<Vec3> points{{0, 0, height(0, 0)}};
    while (points.size() < size) {
        const double x = uniform(random, -1, 1);
        const double y = uniform(random, -0.8, 0.8);
        points.push_back({x, y, height(x, y)});
    }
    return points;
}

struct Fit {
    double curvature = 0;  // absolute
    double outside = 0;    // of the first point, in standard deviations, on the convex side > 0
};

// The same fit by Eigen, in a frame that Eigen finds.
Fit fit_by_eigen(const std::vector<Vec3>& points) {
    const auto n = static_cast<Eigen::Index>(points.size());
    Eigen::MatrixXd rows(n, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
        const Vec3 p = points[static_cast<std::size_t>(i)] - points[0];
        rows.row(i) << p.x, p.y, p.z;
    }
    const Eigen::MatrixXd centred = rows.rowwise() - rows.colwise().mean();
    const Eigen::Matrix3d axes =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(centred.transpose() * centred)
            .eigenvectors();
    const Eigen::VectorXd z = rows * axes.col(0);
    const Eigen::VectorXd y = rows * axes.col(1);
    const Eigen::VectorXd x = rows * axes.col(2);
    Eigen::MatrixXd design(n, 6);
    design << x.cwiseProduct(x), x.cwiseProduct(y), y.cwiseProduct(y), x, y,
        Eigen::VectorXd::Ones(n);
    const Eigen::VectorXd fit = design.colPivHouseholderQr().solve(z);
    const double a = fit[0];
    const double b = fit[1];
    const double c = fit[2];
    const double d = fit[3];
    const double e = fit[4];
    const double curvature = ((1 + e * e) * 2 * a - 2 * d * e * b + (1 + d * d) * 2 * c) /
                             (2 * std::pow(1 + d * d + e * e, 1.5));
    const double deviation =
        (z - design * fit).norm() / std::sqrt(std::max(1.0, static_cast<double>(n) - 6));
    return {std::abs(curvature), (curvature < 0 ? -fit[5] : fit[5]) / deviation};
}

TEST(Quadric, IsTheLeastSquaresFit) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 3000; ++round) {
        const double rough = std::pow(10, uniform(random, -4, -0.7));
        std::vector<Vec3> points = patch(random, 10 + random() % 240, [&](double x, double y) {
            return 0.3 * x * x - 0.2 * x * y + 0.1 * y + uniform(random, -rough, rough);
        });
        const double expected = fit_by_eigen(points).curvature;
        ASSERT_NEAR(estimate(points), expected, 1e-8 * (1 + expected)) << "round " << round;
    }
}

TEST(Quadric, DiscountsPointsOffTheSurface) {
    std::mt19937_64 random(8);
    const CurvatureEstimator discounting({.estimator = Estimator::kQuadric, .discount_noise = true},
                                         1);
    for (int round = 0; round < 1000; ++round) {
        const double rough = std::pow(10, uniform(random, -4, -0.7));
        std::vector<Vec3> points = patch(random, 7 + random() % 240, [&](double x, double y) {
            return 0.3 * x * x - 0.2 * x * y + 0.1 * y + uniform(random, -rough, rough);
        });
        const Fit fit = fit_by_eigen(points);
        const double expected = fit.curvature / (1 + std::pow(fit.outside - 0.5, 2));
        ASSERT_NEAR(discounting.mean_curvature(points), expected, 1e-5 * (1 + expected))
            << "round " << round;
    }
}

TEST(Quadric, APointOutsideCountsForMoreThanOneInside) {
    std::mt19937_64 random(9);
    const CurvatureEstimator discounting({.estimator = Estimator::kQuadric, .discount_noise = true},
                                         1);
    std::vector<Vec3> points = patch(random, 40, [&](double x, double y) {
        return -0.2 * (x * x + y * y) + uniform(random, -0.01, 0.01);
    });
    points[0].z = 0.005;
    const double outside = discounting.mean_curvature(points);
    points[0].z = -0.005;
    EXPECT_GT(outside, discounting.mean_curvature(points));
    points[0].z = 0.05;
    EXPECT_LT(discounting.mean_curvature(points), outside / 2);
}

TEST(Quadric, GivesTheCurvatureOfAQuadricInAnyPoseAndUnit) {
    std::mt19937_64 random(2);
    for (int round = 0; round < 1000; ++round) {
        const double a = uniform(random, -0.2, 0.2);
        const double b = uniform(random, -0.2, 0.2);
        const double c = uniform(random, -0.2, 0.2);
        std::vector<Vec3> points = patch(random, 20 + random() % 40, [&](double x, double y) {
            return a * x * x + b * x * y + c * y * y;
        });
        const Eigen::Quaterniond turn = random_turn(random);
        const double unit = std::pow(10, uniform(random, -5, 5));
        for (Vec3& p : points) {
            p = rotate(turn, {p.x * unit, p.y * unit, p.z * unit});
        }
        // The frame is tilted against the quadric's own, in which alone the heights are one.
        ASSERT_NEAR(estimate(points) * unit, std::abs(a + c), 0.1) << "round " << round;
    }
}

TEST(Quadric, IsTrueToScaleOnSpheresCylindersAndPlanes) {
    std::mt19937_64 random(3);
    for (int round = 0; round < 300; ++round) {
        const double radius = uniform(random, 4, 100);
        const auto sphere = [&](double x, double y) {
            return std::sqrt(radius * radius - x * x - y * y) - radius;
        };
        const auto cylinder = [&](double x, double) {
            return std::sqrt(radius * radius - x * x) - radius;
        };
        ASSERT_NEAR(estimate(patch(random, 31, sphere)) * radius, 1, 0.05);
        ASSERT_NEAR(estimate(patch(random, 31, cylinder)) * 2 * radius, 1, 0.05);
        ASSERT_NEAR(estimate(patch(random, 31, [](double x, double y) { return x - 2 * y; })), 0,
                    1e-9);
    }
}

TEST(Quadric, DoesNotDependOnTheOrderOfTheOthers) {
    std::mt19937_64 random(4);
    for (int round = 0; round < 1000; ++round) {
        std::vector<Vec3> points = patch(random, 4 + random() % 250, [&](double x, double y) {
            return uniform(random, -0.2, 0.2) + x * y;
        });
        const double h = estimate(points);
        std::shuffle(points.begin() + 1, points.end(), random);
        ASSERT_EQ(estimate(points), h);
    }
}

TEST(Quadric, IsTheSameForEverySetOfInstructions) {
    std::mt19937_64 random(5);
    Neighbourhoods some;
    some.resize(37, 31);
    for (std::size_t i = 0; i < some.count; ++i) {
        for (std::size_t at = 0; at < some.size; ++at) {
            const std::size_t place = i * some.stride + at;
            some.x[place] = at == 0 ? 0 : uniform(random, -1, 1);
            some.y[place] = at == 0 ? 0 : uniform(random, -1, 1);
            some.z[place] = at == 0 ? 0 : uniform(random, -0.2, 0.2);
        }
    }
    const CurvatureEstimator estimator(kParams, 1);
    std::vector<double> first;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        CurvatureEstimator::Work work;
        const std::span<const double> found = estimator.mean_curvatures(some, work);
        if (first.empty()) {
            first.assign(found.begin(), found.end());
        }
        EXPECT_TRUE(std::equal(found.begin(), found.end(), first.begin(), first.end()))
            << hwy::TargetName(target);
    }
    hwy::SetSupportedTargetsForTest(0);
    EXPECT_EQ(first.size(), 37U);
}

// Of z = (k1 x^2 + k2 y^2) / 2, turned, by the library.
LocalFrame frame_of(std::mt19937_64& random, double k1, double k2, const Eigen::Quaterniond& turn) {
    std::vector<Vec3> points =
        patch(random, 40, [&](double x, double y) { return (k1 * x * x + k2 * y * y) / 2; });
    for (Vec3& p : points) {
        p = rotate(turn, p);
    }
    return CurvatureEstimator(kParams, 1, true).estimate(points).frame.frame();
}

TEST(Quadric, HasTheFrameOfTheSurface) {
    std::mt19937_64 random(21);
    const double degree = std::numbers::pi / 180;
    for (int round = 0; round < 500; ++round) {
        const double k1 = uniform(random, -0.4, 0.4);
        const double k2 = uniform(random, -0.4, 0.4);
        const double ratio = std::sqrt(std::max(std::abs(k1 / k2), std::abs(k2 / k1)));
        if (ratio < 1.3 || std::abs(k1 + k2) < 0.01) {
            continue;  // no direction is flatter, or the normal may point either way
        }
        const Eigen::Quaterniond turn = random_turn(random);
        const LocalFrame found = frame_of(random, k1, k2, turn);
        const double up = k1 + k2 > 0 ? 1 : -1;
        // What PackedFrame rounds.
        EXPECT_GT(dot(found.normal, rotate(turn, {0, 0, up})), std::cos(1.01 * degree));
        const Vec3 flattest =
            rotate(turn, std::abs(k1) < std::abs(k2) ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
        EXPECT_GT(std::abs(dot(found.flattest, flattest)), std::cos(8.6 * degree));
        EXPECT_NEAR(found.flatness, std::min(ratio, 4.0), 0.11);
    }
}

TEST(Quadric, OfACylinderIsFlattestAlongIt) {
    std::mt19937_64 random(22);
    const LocalFrame found = frame_of(random, 0.3, 0, Eigen::Quaterniond::Identity());
    EXPECT_EQ(found.flatness, 4);
    EXPECT_GT(std::abs(found.flattest.y), std::cos(8.6 * std::numbers::pi / 180));
}

TEST(Fourier, HasTheFrameOfTheNeighbourhood) {
    std::mt19937_64 random(23);
    for (const double side : {1.0, -1.0}) {
        const std::vector<Vec3> points =
            patch(random, 60, [&](double x, double y) { return side * 0.15 * (x * x + y * y); });
        const LocalFrame found =
            CurvatureEstimator(CurvatureParams{}, 0.3, true).estimate(points).frame.frame();
        EXPECT_GT(side * found.normal.z, 0.95) << "towards the side that the surface bends to";
        EXPECT_EQ(found.flatness, 1);
    }
}

TEST(Quadric, WithoutASurfaceHasNoFrame) {
    const CurvatureEstimator estimator(kParams, 1, true);
    EXPECT_TRUE(estimator.estimate(std::vector<Vec3>(5)).frame.is_none()) << "one place";
    EXPECT_TRUE(estimator.estimate(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}}).frame.is_none());
    EXPECT_TRUE(CurvatureEstimator(kParams, 1)
                    .estimate(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}})
                    .frame.is_none())
        << "not asked for";
}

TEST(Quadric, OfPointsOnAPlaneALineOrInOnePlaceIsZero) {
    std::vector<Vec3> arc;
    for (int i = -10; i <= 10; ++i) {
        const double t = 0.02 * i;
        arc.push_back({5 * std::sin(t), 0, 5 * std::cos(t) - 5});
    }
    std::swap(arc[0], arc[10]);
    EXPECT_EQ(estimate(arc), 0) << "a plane";
    std::vector<Vec3> line;
    for (int i = 0; i < 20; ++i) {
        line.push_back({0.1 * i, 0.2 * i, -0.3 * i});
    }
    EXPECT_EQ(estimate(line), 0);
    EXPECT_EQ(estimate(std::vector<Vec3>(20, Vec3{1e6, 2e6, 3e6})), 0) << "one place";
    EXPECT_EQ(estimate({{0, 0, 0}, {1, 0, 0}, {0, 1, 1}}), 0) << "three points";
}

TEST(Quadric, IsFiniteForAnyNeighbourhood) {
    std::mt19937_64 random(6);
    for (int round = 0; round < 5000; ++round) {
        std::vector<Vec3> points(4 + random() % 40);
        const double unit = std::pow(10, uniform(random, -150, 70));
        for (Vec3& p : points) {
            const auto coordinate = [&] {
                return unit * static_cast<double>(static_cast<int>(random() % 7) - 3);
            };
            p = {coordinate(), coordinate(), coordinate()};
        }
        const double h = estimate(points);
        ASSERT_TRUE(std::isfinite(h));
        ASSERT_GE(h, 0);
    }
}

}  // namespace
}  // namespace knap
