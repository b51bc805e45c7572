#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "knap/geometry.hpp"
#include "stopwatch.hpp"

/// What the programs behind tools/compare have in common: one for each library that stands beside
/// knap.
namespace knap {

/// What a way kept, in the order that its library gave.
struct Simplified {
    std::vector<Vec3> points;  ///< cloud units
    double seconds = 0;        ///< wall, of the library's calls alone
};

/// A way to simplify one cloud, steered by one parameter.
struct Way {
    std::function<Simplified(double parameter)> simplify;
    std::function<double(double count)> parameter_for;  ///< what gives about `count` points
};

/// The finite points of a file, in its order.
/// @throws InputError if it cannot be read
std::vector<Vec3> finite_points(const std::string& path);

/// Halves [low, high] until a way keeps `count` points within 0.3 %, or no half is left.
/// @param simplify  keeps fewer points with a larger parameter
double search_parameter(const std::function<Simplified(double)>& simplify, double count, double low,
                        double high);

/// A cell size, or the like, above which fewer than `count` points of a surface are left.
double largest_cell(const std::vector<Vec3>& points, double count);

template <typename Call>
double seconds_of(const Call& call) {
    const auto start = std::chrono::steady_clock::now();
    call();
    return seconds_since(start);
}

/// The program: PROGRAM find WAY CLOUD COUNT, or PROGRAM run WAY CLOUD PARAMETER OUT.ply.
/// The first prints the parameter; the second writes the points and prints how many and seconds.
/// @param make  the way of a name for a cloud; ConfigError if there is none of the name
/// @return exit status
int run_peer(int argc, char** argv, const std::string& program,
             const std::function<Way(const std::string& name, const std::string& cloud)>& make);

}  // namespace knap
