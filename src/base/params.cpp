#include "knap/params.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "knap/error.hpp"

namespace knap {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr std::array<std::string_view, 2> kEstimators{"fourier", "quadric"};
constexpr std::array<std::string_view, 2> kLaws{"reciprocal", "chord"};
constexpr std::array<std::string_view, 3> kEncodings{"auto", "kd", "sequential"};

template <typename Enum>
Choice choice_of(Enum& value, std::span<const std::string_view> names) {
    return {
        &value, names,
        [](const void* from) { return static_cast<std::size_t>(*static_cast<const Enum*>(from)); },
        [](void* to, std::size_t place) { *static_cast<Enum*>(to) = static_cast<Enum>(place); }};
}

constexpr std::array kParameters{
    Parameter{.key = "input",
              .flag = "input",
              .unit = "",
              .range = "files, folders, globs",
              .help = "point clouds that make up the archive, in this order",
              .required = true,
              .field = [](Job& job) -> ParameterField { return &job.input; }},
    Parameter{.key = "curvature.estimator",
              .flag = "--estimator",
              .unit = "",
              .range = "fourier or quadric",
              .help = "surface that a point's curvature is read from",
              .in_result = true,
              .field = [](Job& job) -> ParameterField {
                  return choice_of(job.curvature.estimator, kEstimators);
              }},
    Parameter{.key = "curvature.neighbours",
              .flag = "--neighbours",
              .unit = "points",
              .range = "3 .. 255",
              .help = "nearest other points that a point's curvature is read from",
              .low = 3,
              .high = 255,
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.curvature.neighbours; }},
    Parameter{.key = "curvature.samples",
              .flag = "--samples",
              .unit = "",
              .range = "even, 4 .. 64",
              .help = "samples along each axis of the truncated Fourier series",
              .low = 4,
              .high = 64,
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.curvature.samples; }},
    Parameter{.key = "curvature.step",
              .flag = "--sample-step",
              .unit = "mean spacings",
              .range = "> 0, <= 10",
              .help = "distance between two samples",
              .low = 0,
              .high = 10,
              .low_open = true,
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.curvature.step; }},
    Parameter{.key = "curvature.discount_noise",
              .flag = "--discount-noise",
              .unit = "",
              .range = "true, false",
              .help = "count a point's curvature for less, the farther it is off its quadric",
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.curvature.discount_noise; }},
    Parameter{.key = "range.law",
              .flag = "--law",
              .unit = "",
              .range = "reciprocal or chord",
              .help = "how a radius follows from curvature: alpha Hm/|H|, or alpha sqrt(Hm/|H|)",
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return choice_of(job.range.law, kLaws); }},
    Parameter{.key = "range.alpha",
              .flag = "--alpha",
              .unit = "cloud units",
              .range = "> 0, finite",
              .help = "radius that a point of mean curvature stands for",
              .low = 0,
              .high = std::numeric_limits<double>::max(),
              .low_open = true,
              .target = true,
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.range.alpha; }},
    Parameter{.key = "range.tolerance",
              .flag = "--tolerance",
              .unit = "cloud units",
              .range = "> 0, finite",
              .help = "instead of alpha: distance by which the surface may move (chord law)",
              .low = 0,
              .high = std::numeric_limits<double>::max(),
              .low_open = true,
              .target = true,
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.range.tolerance; }},
    Parameter{.key = "range.ratio",
              .flag = "--ratio",
              .unit = "",
              .range = "> 0, <= 1",
              .help = "instead of alpha: share of the input points to keep, within 1 %",
              .low = 0,
              .high = 1,
              .low_open = true,
              .target = true,
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.range.ratio; }},
    Parameter{.key = "range.count",
              .flag = "--count",
              .unit = "points",
              .range = ">= 1",
              .help = "instead of alpha: number of points to keep, within 1 %",
              .low = 1,
              .target = true,
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.range.count; }},
    Parameter{.key = "range.min_factor",
              .flag = "--min-factor",
              .unit = "",
              .range = "> 0, <= 1",
              .help = "smallest radius over alpha, at the sharpest features",
              .low = 0,
              .high = 1,
              .low_open = true,
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.range.min_factor; }},
    Parameter{.key = "range.max_factor",
              .flag = "--max-factor",
              .unit = "",
              .range = ">= 1, or inf",
              .help = "largest radius over alpha, on flat ground",
              .low = 1,
              .high = kInfinity,
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.range.max_factor; }},
    Parameter{.key = "range.slab",
              .flag = "--slab",
              .unit = "",
              .range = "0 .. 10",
              .help = "a point stands only for points so near its osculating surface, over its "
                      "radius; 0: any",
              .low = 0,
              .high = 10,
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.range.slab; }},
    Parameter{.key = "range.aspect",
              .flag = "--aspect",
              .unit = "",
              .range = "1 .. 4",
              .help = "most by which what a point stands for is longer than wide (quadric)",
              .low = 1,
              .high = 4,
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.range.aspect; }},
    Parameter{.key = "range.repair",
              .flag = "--repair",
              .unit = "",
              .range = "0 .. 0.9",
              .help = "share of the kept points that is added where the surface is farthest off",
              .low = 0,
              .high = 0.9,
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.range.repair; }},
    Parameter{.key = "output.path",
              .flag = "--output",
              .unit = "",
              .range = "a folder, or a file ending in .drc or .ply",
              .help = "where the result goes: an archive folder, or one file",
              .required = true,
              .field = [](Job& job) -> ParameterField { return &job.output.path; }},
    Parameter{.key = "output.step",
              .flag = "--step",
              .unit = "cloud units",
              .range = ">= 0, finite",
              .help = "lattice step of Draco output; 0: the LAS scale, else about spacing / 64",
              .low = 0,
              .high = std::numeric_limits<double>::max(),
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.output.step; }},
    Parameter{.key = "output.tile_points",
              .flag = "--tile-points",
              .unit = "points",
              .range = "1000 .. 10000000",
              .help = "most points in one tile",
              .low = 1000,
              .high = 1e7,
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.output.tile_points; }},
    Parameter{.key = "output.attributes",
              .flag = "--attributes",
              .unit = "",
              .range = "all, none, or names",
              .help = "what kept points carry beside their position",
              .in_result = true,
              .field = [](Job& job) -> ParameterField { return &job.output.attributes; }},
    Parameter{.key = "output.encoding",
              .flag = "--encoding",
              .unit = "",
              .range = "auto, kd or sequential",
              .help = "how Draco codes tiles; auto: the way that makes the first one smallest",
              .in_result = true,
              .field = [](Job& job) -> ParameterField {
                  return choice_of(job.output.encoding, kEncodings);
              }},
    Parameter{.key = "output.ids",
              .flag = "--ids",
              .unit = "",
              .range = "a file",
              .help = "also write the kept ids, one decimal number a line, ascending",
              .field = [](Job& job) -> ParameterField { return &job.output.ids; }},
    Parameter{.key = "output.overwrite",
              .flag = "--overwrite",
              .unit = "",
              .range = "true, false",
              .help = "replace an output that exists",
              .field = [](Job& job) -> ParameterField { return &job.output.overwrite; }},
    Parameter{.key = "output.report",
              .flag = "--report",
              .unit = "",
              .range = "true, false",
              .help = "also write report.html: pictures, histograms, counts, cost",
              .field = [](Job& job) -> ParameterField { return &job.output.report; }},
    Parameter{
        .key = "resources.memory",
        .flag = "--memory",
        .unit = "bytes, or with KiB, MiB, GiB, TiB",
        .range = ">= 256MiB",
        .help = "resident memory that the job may use",
        .low = 256.0 * 1024 * 1024,
        .field = [](Job& job) -> ParameterField { return Bytes{&job.resources.memory_bytes}; }},
    Parameter{.key = "resources.threads",
              .flag = "--threads",
              .unit = "",
              .range = "0 .. 1024",
              .help = "threads; 0: one a core",
              .low = 0,
              .high = 1024,
              .field = [](Job& job) -> ParameterField { return &job.resources.threads; }},
    Parameter{.key = "resources.scratch",
              .flag = "--scratch",
              .unit = "",
              .range = "a folder",
              .help = "where working files go; empty: beside the output",
              .field = [](Job& job) -> ParameterField { return &job.resources.scratch; }},
    Parameter{.key = "resources.brick_points",
              .flag = "--brick-points",
              .unit = "points",
              .range = ">= 0",
              .help = "points a brick aims at; 0: as many as memory and threads suggest",
              .low = 0,
              .field = [](Job& job) -> ParameterField { return &job.resources.brick_points; }},
};

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

bool Choice::choose(std::string_view name) const {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
        return false;
    }
    set(value, static_cast<std::size_t>(found - names.begin()));
    return true;
}

std::span<const Parameter> parameters() {
    return kParameters;
}

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
    for (const Parameter& parameter : kParameters) {
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
