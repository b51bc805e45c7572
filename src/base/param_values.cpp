#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "knap/error.hpp"
#include "knap/params.hpp"

namespace knap {

namespace {

struct Numeric {
    bool is_number = false;
    double value = 0;
};

Numeric numeric(const ParameterField& field) {
    return std::visit(
        [](auto pointer) -> Numeric {
            using T = decltype(pointer);
            if constexpr (std::is_same_v<T, Bytes>) {
                return {true, static_cast<double>(*pointer.value)};
            } else if constexpr (std::is_same_v<T, double*> || std::is_same_v<T, int*> ||
                                 std::is_same_v<T, std::uint64_t*>) {
                return {true, static_cast<double>(*pointer)};
            } else {
                return {};
            }
        },
        field);
}

/// A size with the largest binary unit that leaves it whole: "4GiB".
std::string format_size(std::uint64_t bytes) {
    constexpr std::array kUnits{"", "KiB", "MiB", "GiB", "TiB"};
    std::size_t unit = 0;
    while (bytes != 0 && bytes % 1024 == 0 && unit + 1 < kUnits.size()) {
        bytes /= 1024;
        ++unit;
    }
    return fmt::format("{}{}", bytes, kUnits[unit]);
}

/// All, none, or names without either.
bool names_attributes(const std::vector<std::string>& wanted) {
    const auto is_word = [](const std::string& name) { return name == "all" || name == "none"; };
    const auto is_empty = [](const std::string& name) { return name.empty(); };
    return !wanted.empty() && std::none_of(wanted.begin(), wanted.end(), is_empty) &&
           (wanted.size() == 1 || std::none_of(wanted.begin(), wanted.end(), is_word));
}

bool is_missing(const ParameterField& field) {
    if (const auto* text = std::get_if<std::string*>(&field)) {
        return (*text)->empty();
    }
    if (const auto* list = std::get_if<std::vector<std::string>*>(&field)) {
        return (*list)->empty();
    }
    return numeric(field).value == 0;
}

}  // namespace

std::string format_value(const Parameter& parameter, const Job& job) {
    Job copy = job;
    return std::visit(
        [](auto pointer) -> std::string {
            using T = decltype(pointer);
            if constexpr (std::is_same_v<T, Bytes>) {
                return format_size(*pointer.value);
            } else if constexpr (std::is_same_v<T, Choice>) {
                return std::string(pointer.chosen());
            } else {
                return fmt::format("{}", *pointer);
            }
        },
        parameter.field(copy));
}

void validate(const Parameter& parameter, const Job& job) {
    Job copy = job;
    const ParameterField field = parameter.field(copy);
    const Numeric number = numeric(field);
    // Written so that NaN fails.
    const bool inside = number.value >= parameter.low && number.value <= parameter.high &&
                        !(parameter.low_open && number.value == parameter.low);
    const bool pairs = parameter.key != "curvature.samples" || job.curvature.samples % 2 == 0;
    const bool names =
        parameter.key != "output.attributes" || names_attributes(job.output.attributes);
    if ((number.is_number && !(inside && pairs)) || !names) {
        throw ConfigError(fmt::format("{} ({}): expected {}, found {}", parameter.key,
                                      parameter.flag, parameter.range,
                                      format_value(parameter, job)));
    }
}

void validate(const Job& job) {
    Job copy = job;
    std::vector<std::string> targets;
    std::vector<std::string> given;
    for (const Parameter& parameter : parameters()) {
        const bool missing = is_missing(parameter.field(copy));
        if (parameter.required && missing) {
            throw ConfigError(fmt::format("{} ({}): expected {}, found none", parameter.key,
                                          parameter.flag, parameter.range));
        }
        if (parameter.target) {
            targets.push_back(fmt::format("{} ({})", parameter.key, parameter.flag));
            if (missing) {
                continue;
            }
            given.emplace_back(parameter.flag);
        }
        validate(parameter, job);
    }
    if (given.size() != 1) {
        throw ConfigError(
            fmt::format("expected one of {}, found {}", fmt::join(targets, ", "),
                        given.empty() ? "none" : fmt::format("{}", fmt::join(given, " and "))));
    }
    if (job.curvature.discount_noise && job.curvature.estimator != Estimator::kQuadric) {
        throw ConfigError(
            "curvature.discount_noise (--discount-noise): expected curvature.estimator = quadric, "
            "found fourier");
    }
    if (job.range.aspect > 1 && job.curvature.estimator != Estimator::kQuadric) {
        throw ConfigError(
            "range.aspect (--aspect): above 1 expected curvature.estimator = quadric, found "
            "fourier");
    }
    if (job.range.tolerance > 0 &&
        (job.curvature.estimator != Estimator::kQuadric || job.range.law != RangeLawKind::kChord)) {
        throw ConfigError(
            "range.tolerance (--tolerance): expected curvature.estimator = quadric and range.law = "
            "chord, as --preset accurate has them, found others");
    }
}

}  // namespace knap
