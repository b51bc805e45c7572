#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "knap/export.hpp"

namespace knap {

/// Where mean curvature is read from (method section 2).
enum class Estimator {
    kFourier,  ///< a truncated Fourier series along two axes: the paper's
    kQuadric   ///< a quadric fitted to the neighbourhood: true to scale
};

/// How a point's radius follows from its curvature (method section 3).
enum class RangeLawKind {
    kReciprocal,  ///< alpha Hm / |H|: equal turning, the paper's
    kChord        ///< alpha sqrt(Hm / |H|): equal height of the chord
};

/// How mean curvature is estimated (method sections 2 and 3).
struct CurvatureParams {
    Estimator estimator = Estimator::kFourier;
    int neighbours = 30;  ///< nearest other points a point's surface is read from, [3, 255]
    int samples =
        8;  ///< samples along each axis (N of the truncated Fourier series), even, [4, 64]
    double step = 0.8;  ///< distance of two samples over the mean spacing, (0, 10]
    /// |H| of a point counts for less the farther it lies off its quadric, measured by the standard
    /// deviation of its neighbours. Needs the quadric.
    bool discount_noise = false;
};

/// Which neighbours of a kept point it stands for.
struct RangeParams {
    RangeLawKind law = RangeLawKind::kReciprocal;
    /// Range at mean curvature, cloud units, > 0; or 0, and it follows from one of the next three.
    double alpha = 0.0;
    /// Distance by which the surface may move, cloud units, > 0: alpha = sqrt(2 tolerance / Hm),
    /// and points are added where that is not enough. Needs the chord law and a curvature that is
    /// true to scale.
    double tolerance = 0;
    double ratio = 0;             ///< kept / input points, within 1 %, (0, 1]
    std::uint64_t count = 0;      ///< points to keep, within 1 %
    double min_factor = 1.0 / 3;  ///< smallest range / alpha, (0, 1]
    double max_factor = 8.0;      ///< largest range / alpha, >= 1, may be infinite
    /// A point stands only for points within a slab about its osculating surface, so that the far
    /// side of a thin object is left: half the slab's thickness / range, [0, 10]; 0: no slab.
    double slab = 0;
    /// Most by which the region that a point stands for is longer along the direction in which the
    /// surface bends least than across it, at equal area, [1, 4]; 1: balls. Needs the quadric.
    double aspect = 1;
    /// Share of the kept points that are not found by walking ranges, but added where the surface
    /// through the others is farthest away, [0, 0.9]. With a tolerance as many are added as it
    /// takes.
    double repair = 0;
    /// Points that are kept whatever the ranges say: a condition on attributes, see docs/method.md;
    /// empty: none. Not for points in memory, which have no attributes.
    std::string keep = std::string();
};

/// How tiles are coded (docs/formats.md).
enum class TileEncoding {
    kAuto,       ///< by the smallest that the first tile gives
    kKdTree,     ///< Draco's kd-tree, which forgets the order of points
    kSequential  ///< Draco's sequential encoding of points in a good order
};

/// Where the result goes and how it is cut. `path`: an archive folder, or a file ending in .drc,
/// .ply, .las, .laz or .xyz.
struct OutputParams {
    std::string path;
    double step = 0;  ///< lattice step, cloud units, >= 0; 0: LAS scale or spacing / 64
    std::uint64_t tile_points = 100000;  ///< most points in a tile, [1000, 10000000]
    /// What points carry beside their position: "all", "none", or names, at least one.
    std::vector<std::string> attributes{"all"};
    TileEncoding encoding = TileEncoding::kAuto;
    /// Write all points, and with each whether it is kept. For .ply, .las, .laz and .xyz.
    bool flag = false;
    /// Carry each kept point's `curvature` and `range` too.
    bool measures = false;
    std::string ids;         ///< also write the kept ids to this file; empty: do not
    bool overwrite = false;  ///< replace an output that exists
    bool report = false;     ///< also write report.html
    /// Also write 3D Tiles of the kept points, into an archive.
    bool tileset = false;
};

/// What the job may use. Nothing here changes the result.
struct ResourceParams {
    std::uint64_t memory_bytes = std::uint64_t{4} << 30;  ///< resident memory, >= 256 MiB
    int threads = 0;                                      ///< [0, 1024]; 0: one a core
    std::string scratch;             ///< working folder; empty: beside the output
    std::uint64_t brick_points = 0;  ///< points a brick aims at; 0: by memory
};

/// A whole job: what `knap run` reads from a file.
struct Job {
    std::vector<std::string> input;  ///< files, folders and globs: one archive; "-": see below
    CurvatureParams curvature;
    RangeParams range;
    OutputParams output;
    ResourceParams resources;
    /// Throw away what an unfinished run of the same output left, instead of going on with it.
    bool restart = false;
    /// The file that the input "-" stands for: standard input, copied by who calls the library,
    /// as a job reads its input more than once.
    std::filesystem::path standard_input = std::filesystem::path();
};

/// The input that is no file.
inline constexpr const char* kStandardInput = "-";

/// Sets curvature and range, all but the target, to what a name stands for: "paper" is the method
/// as published; "accurate" comes closest to the surface, see docs/quality.md.
/// @throws ConfigError if there is no such preset
KNAP_API void apply_preset(Job& job, std::string_view name);

/// A size, which takes suffixes KiB, MiB, GiB, TiB.
struct Bytes {
    std::uint64_t* value;
};

/// One of some names: an enumeration whose values are the places of their names.
struct Choice {
    void* value;
    std::span<const std::string_view> names;
    std::size_t (*get)(const void* value);
    void (*set)(void* value, std::size_t place);

    std::string_view chosen() const { return names[get(value)]; }
    /// False if there is no such name.
    KNAP_API bool choose(std::string_view name) const;
};

/// A pointer to one field of a Job.
using ParameterField = std::variant<double*, int*, std::uint64_t*, Bytes, Choice, bool*,
                                    std::string*, std::vector<std::string>*>;

/// One row of the table behind job files, flags, `--help`, validation and the manifest.
struct Parameter {
    std::string_view key;                                   ///< in a job file: "range.alpha"
    std::string_view flag;                                  ///< on the command line: "--alpha"
    std::string_view unit;                                  ///< "cloud units", "points", ""
    std::string_view range;                                 ///< allowed values as text: "> 0"
    std::string_view help;                                  ///< one line
    double low = -std::numeric_limits<double>::infinity();  ///< numbers: smallest allowed value
    double high = std::numeric_limits<double>::infinity();  ///< numbers: largest allowed value
    bool low_open = false;                                  ///< `low` itself is not allowed
    bool required = false;                                  ///< has no usable default
    bool target = false;     ///< one of those so marked is given, and only one
    bool in_result = false;  ///< changes the result, so it is part of the manifest
    ParameterField (*field)(Job&) = nullptr;
};

/// Every parameter once, in the order of the job file.
KNAP_API std::span<const Parameter> parameters();

/// Checks the value of one parameter against its range; whether it was given at all is not asked.
/// @throws ConfigError naming the key, its value and the range
KNAP_API void validate(const Parameter& parameter, const Job& job);

/// Checks a job against the table: every required parameter is there, every value in its range.
/// @throws ConfigError naming the first key out of range, its value and the range
KNAP_API void validate(const Job& job);

/// The value of a parameter as a job file would write it.
KNAP_API std::string format_value(const Parameter& parameter, const Job& job);

}  // namespace knap
