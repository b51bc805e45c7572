#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "evaluate/deviation.hpp"
#include "knap/geometry.hpp"
#include "surface/surface.hpp"

namespace knap {

/// The distinct finite points of a simplified cloud: an archive folder, or a file.
/// @throws InputError if it cannot be read
std::vector<Vec3> simplified_points(const std::filesystem::path& path);

/// What an evaluation found.
struct Evaluation {
    Deviation deviation;
    Box box;  ///< of the original points: its diagonal is what distances are divided by
};

/// Streams the original points and measures how far they are from a surface through the simplified
/// ones. Points that are not finite do not count.
/// @param threads  >= 1; makes no difference to the result
/// @param advance  told how many points were measured; from any thread
/// @throws InputError if an original cannot be read
Evaluation evaluate(const std::vector<std::filesystem::path>& originals, const Surface& surface,
                    int threads, const std::function<void(std::uint64_t)>& advance);

/// One line for people: mean, rms, p99 and max over the diagonal, in the order of the header line
/// that describe_header() gives; and the paper's D, where there is one.
std::string describe(const std::string& name, const Evaluation& evaluation);
std::string describe_header();

}  // namespace knap
