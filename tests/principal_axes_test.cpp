#include "curvature/principal_axes.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>

namespace knap {
namespace {

double uniform(std::mt19937_64& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

Neighbourhoods random_neighbourhoods(std::mt19937_64& random, std::size_t count, std::size_t size) {
    Neighbourhoods result;
    result.resize(count, size);
    for (std::size_t i = 0; i < count; ++i) {
        const double scale = std::pow(10, uniform(random, -20, 20));
        const double thickness = std::pow(10, uniform(random, -6, 0));
        const int plane = static_cast<int>(random() % 4);
        for (std::size_t j = 0; j < size; ++j) {
            const std::size_t at = i * result.stride + j;
            result.x[at] = j == 0 ? 0 : scale * uniform(random, -1, 1);
            result.y[at] = j == 0 ? 0 : scale * uniform(random, -0.7, 0.7);
            result.z[at] = j == 0 ? 0 : scale * thickness * uniform(random, -1, 1);
            if (plane == 0) {
                std::swap(result.x[at], result.z[at]);
            } else if (plane == 1) {
                result.z[at] += result.x[at] / 2 - result.y[at] / 3;
            }
        }
    }
    return result;
}

Eigen::Matrix3d covariance_of(const Neighbourhoods& of, std::size_t i) {
    Eigen::MatrixXd rows(static_cast<Eigen::Index>(of.size), 3);
    for (std::size_t j = 0; j < of.size; ++j) {
        const std::size_t at = i * of.stride + j;
        rows.row(static_cast<Eigen::Index>(j)) << of.x[at], of.y[at], of.z[at];
    }
    rows /= rows.cwiseAbs().maxCoeff();
    const Eigen::MatrixXd centred = rows.rowwise() - rows.colwise().mean();
    return centred.transpose() * centred;
}

TEST(PrincipalAxes, AreTheEigenvectorsWithTheSignsOfEigensIterativeSolver) {
    std::mt19937_64 random(1);
    int compared = 0;
    int turned = 0;
    PrincipalAxes found;
    for (int round = 0; round < 400; ++round) {
        const Neighbourhoods of =
            random_neighbourhoods(random, 1 + random() % 40, 4 + random() % 253);
        find_principal_axes(of, found);
        for (std::size_t i = 0; i < of.count; ++i) {
            const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance_of(of, i));
            const Eigen::Vector3d values = solver.eigenvalues();
            // Rounding turns an eigenvector by about 1e-15 over the gap of the eigenvalues.
            const double gap = std::min(values[1] - values[0], values[2] - values[1]) / values[2];
            if (gap < 1e-3) {
                continue;
            }
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const Eigen::Vector3d expected =
                    solver.eigenvectors().col(static_cast<Eigen::Index>(axis));
                const Eigen::Vector3d actual(found.axes[axis][0][i], found.axes[axis][1][i],
                                             found.axes[axis][2][i]);
                const double sign = actual.dot(expected) > 0 ? 1 : -1;
                ASSERT_LT((actual - sign * expected).norm(), 1e-11)
                    << "round " << round << ", neighbourhood " << i << ", axis " << axis;
                turned += sign < 0 ? 1 : 0;
                ++compared;
            }
        }
    }
    EXPECT_GT(compared, 10000);
    // Each step of the iteration may turn a vector round, and whether there is one step more can
    // hang on the last bit.
    EXPECT_LT(turned, compared / 1000);
}

TEST(PrincipalAxes, DoNotDependOnTheOrderOfPointsNorOnWhatStandsBeside) {
    std::mt19937_64 random(2);
    PrincipalAxes together;
    PrincipalAxes alone;
    for (int round = 0; round < 200; ++round) {
        const Neighbourhoods of =
            random_neighbourhoods(random, 1 + random() % 20, 4 + random() % 253);
        find_principal_axes(of, together);
        for (std::size_t i = 0; i < of.count; ++i) {
            std::vector<std::size_t> order(of.size);
            for (std::size_t j = 0; j < order.size(); ++j) {
                order[j] = i * of.stride + j;
            }
            std::shuffle(order.begin(), order.end(), random);
            Neighbourhoods shuffled;
            shuffled.resize(1, of.size);
            for (std::size_t j = 0; j < order.size(); ++j) {
                shuffled.x[j] = of.x[order[j]];
                shuffled.y[j] = of.y[order[j]];
                shuffled.z[j] = of.z[order[j]];
            }
            find_principal_axes(shuffled, alone);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                for (std::size_t row = 0; row < 3; ++row) {
                    ASSERT_EQ(alone.axes[axis][row][0], together.axes[axis][row][i]);
                }
            }
            ASSERT_EQ(alone.largest[0], together.largest[i]);
        }
    }
}

TEST(PrincipalAxes, OfOnePlaceTellThatThereIsNoExtent) {
    Neighbourhoods none;
    none.resize(3, 10);
    std::fill(none.x.begin(), none.x.end(), 0.0);
    none.y = none.z = none.x;
    PrincipalAxes found;
    find_principal_axes(none, found);
    EXPECT_EQ(found.largest, (std::vector<double>(3, 0.0)));
}

}  // namespace
}  // namespace knap
