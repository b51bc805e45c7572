#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace knap {

/// How far the original points are from the surface of the kept ones; lengths in cloud units.
struct MeasuredError {
    std::string original;  ///< as the user named it
    std::uint64_t points = 0;
    double mean = 0;
    double rms = 0;
    double p99 = 0;
    double max = 0;
    double diagonal = 0;  ///< of the original's box, > 0
    double spacing = 0;   ///< of the original; 0: not known
};

/// The part of a report that says how large the error is, or that it was not measured. It stands
/// between two comments, so that it can be replaced.
std::string format_error_section(const std::optional<MeasuredError>& error);

/// A report with another error in it.
/// @return nothing if the page is no report of knap
std::optional<std::string> replace_error_section(std::string_view page, const MeasuredError& error);

}  // namespace knap
