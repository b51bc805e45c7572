#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include "app/commands.hpp"
#include "app/format.hpp"
#include "app/interrupt.hpp"
#include "app/options.hpp"
#include "app/synth.hpp"
#include "app/synth_writer.hpp"
#include "app/value.hpp"
#include "base/file.hpp"
#include "base/threads.hpp"
#include "knap/error.hpp"

namespace knap::app {

namespace {

constexpr std::uint64_t kMostPoints = std::uint64_t{1} << 40;
constexpr double kFlakeNoise = 0.0005;  // mm

struct SynthOptions {
    std::string shape;
    std::string points;
    std::string seed = "1";
    std::string noise;
    std::string threads = "0";
    OutputFileOptions output;
};

SynthParams parse(const SynthOptions& options) {
    SynthParams params;
    const std::optional<Shape> shape = shape_of(options.shape);
    if (!shape) {
        throw ConfigError(fmt::format(
            "synth: expected flake, sphere, torus, blade or terrain, found \"{}\"", options.shape));
    }
    params.shape = *shape;
    params.points = parse_count(options.points, "--points");
    params.seed = parse_count(options.seed, "--seed");
    params.noise = params.shape == Shape::kFlake ? kFlakeNoise : 0;
    if (!options.noise.empty()) {
        params.noise = parse_number(options.noise, "--noise");
    }
    if (!(params.noise >= 0 && std::isfinite(params.noise))) {
        throw ConfigError(fmt::format("--noise: expected >= 0, finite, found {}", params.noise));
    }
    if (params.points > kMostPoints) {
        throw ConfigError(
            fmt::format("--points: expected 0 .. {}, found {}", kMostPoints, params.points));
    }
    return params;
}

void check_ending(const std::string& path) {
    const std::filesystem::path ending = std::filesystem::path(path).extension();
    if (ending != ".ply" && ending != ".xyz") {
        throw ConfigError(
            fmt::format("--output: expected a file ending in .ply or .xyz, found \"{}\"", path));
    }
}

void synth(const SynthOptions& options) {
    const SynthParams params = parse(options);
    const std::uint64_t threads = parse_count(options.threads, "--threads");
    if (threads > 1024) {
        throw ConfigError(fmt::format("--threads: expected 0 .. 1024, found {}", threads));
    }
    check_output_file(options.output);
    check_ending(options.output.path);
    catch_interrupts();
    const ThreadLimit limit(thread_count(static_cast<int>(threads)));
    const auto started = std::chrono::steady_clock::now();
    write_cloud(SynthCloud(params), params.points, options.output.path);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - started;
    fmt::print("{}: {} of {} points, {}, {}\n", options.output.path, options.shape,
               format_count(params.points),
               format_bytes(std::filesystem::file_size(options.output.path)),
               format_seconds(elapsed.count()));
}

}  // namespace

Command add_synth(CLI::App& root) {
    CLI::App* const command =
        root.add_subcommand("synth", "write a cloud of any size whose shape is known");
    const auto options = std::make_shared<SynthOptions>();
    command
        ->add_option("SHAPE", options->shape,
                     "flake: a knapped stone tool, about 60 x 35 x 10 mm\n"
                     "sphere: radius 1, |H| = 1\n"
                     "torus: radii 1 and 0.35, |H| = |1 + 0.7 cos v| / (0.7 (1 + 0.35 cos v))\n"
                     "blade: 60 x 20, sharp edges, 1 thick in the middle, |H| = 1 / 200.5\n"
                     "terrain: 1000 x 1000, ridges, even in plan")
        ->type_name("flake|sphere|torus|blade|terrain")
        ->required();
    command->add_option("-n,--points", options->points, "how many points\n[0 .. 2^40; required]")
        ->type_name("INTEGER")
        ->required();
    add_output_file_options(*command, options->output, ".ply (binary float) or .xyz (text)");
    command->add_option("--seed", options->seed, "another seed, another cloud\n[>= 0; default 1]")
        ->type_name("INTEGER");
    command
        ->add_option("--noise", options->noise,
                     "largest distance of a point from the surface, along the normal\n"
                     "[cloud units; >= 0, finite; default 0.0005 for the flake, else 0]")
        ->type_name("NUMBER");
    command
        ->add_option("--threads", options->threads,
                     "threads; 0: one a core; never changes the cloud\n[0 .. 1024; default 0]")
        ->type_name("INTEGER");
    command->footer(
        "Points lie strip by strip, as a scanner delivers them, about evenly by area.\n\n"
        "Examples:\n"
        "  knap synth flake --points 1000000 -o flake.ply\n"
        "  knap synth sphere --points 20000 --noise 0.001 --seed 7 -o sphere.xyz");
    return {command, [options] { synth(*options); }};
}

}  // namespace knap::app
