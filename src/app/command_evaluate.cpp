#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.hpp"
#include "app/interrupt.hpp"
#include "app/options.hpp"
#include "app/progress.hpp"
#include "base/file.hpp"
#include "base/threads.hpp"
#include "emit/output_check.hpp"
#include "evaluate/evaluate.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "knap/job.hpp"
#include "knap/source.hpp"
#include "pipeline/stage_clock.hpp"
#include "report/error_section.hpp"
#include "surface/fan_surface.hpp"

namespace knap::app {

namespace {

namespace fs = std::filesystem;

struct EvaluateOptions {
    std::string original;
    std::string simplified;
    std::string surface = "fans";
    int threads = 0;
    bool report = false;
    ProgressOptions progress;
};

// At once: the other program writes to the same place.
void print_line(const std::string& line) {
    fmt::print("{}\n", line);
    std::fflush(stdout);
}

/// The program that measures by a mesh lies beside this one: CGAL's licence is another.
fs::path mesh_program() {
    return fs::read_symlink("/proc/self/exe").parent_path() / "knap-front-mesh";
}

void run_mesh_program(const EvaluateOptions& options, const std::vector<fs::path>& originals) {
    catch_interrupts();
    std::vector<std::string> arguments{mesh_program().string(), options.simplified,
                                       std::to_string(thread_count(options.threads))};
    for (const fs::path& original : originals) {
        arguments.push_back(original.string());
    }
    std::vector<char*> argv;
    argv.reserve(arguments.size() + 1);
    for (std::string& argument : arguments) {
        argv.push_back(argument.data());
    }
    argv.push_back(nullptr);
    pid_t child = 0;
    int status = 0;
    if (::posix_spawn(&child, argv[0], nullptr, nullptr, argv.data(), environ) != 0) {
        throw StorageError(fmt::format("{}: cannot run it", arguments[0]));
    }
    // A signal that came to this program alone ends the other too.
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
        ::kill(child, SIGTERM);
    }
    throw_if_interrupted();
    if (!WIFEXITED(status) || WEXITSTATUS(status) == 2) {
        throw StorageError(fmt::format("{}: failed", arguments[0]));
    }
    if (WEXITSTATUS(status) != 0) {
        throw InputError(fmt::format("{}: cannot measure it by a mesh", options.simplified));
    }
}

/// The report of a simplified cloud.
/// @throws ConfigError if there is none
std::string read_report(const EvaluateOptions& options) {
    const fs::path path = report_path(options.simplified);
    if (!fs::exists(path)) {
        throw ConfigError(fmt::format(
            "--report: expected {}, which knap run --report writes, found none", path.string()));
    }
    return read_text_file(path);
}

void put_into_report(const EvaluateOptions& options, const Evaluation& found) {
    std::error_code ignored;
    const bool is_archive = fs::is_directory(options.simplified, ignored);
    const std::optional<std::string> page = replace_error_section(
        read_report(options),
        {.original = options.original,
         .points = found.deviation.points,
         .mean = found.deviation.mean,
         .rms = found.deviation.rms,
         .p99 = found.deviation.p99,
         .max = found.deviation.max,
         .diagonal = found.box.diagonal(),
         .spacing = is_archive ? Archive(options.simplified).manifest().spacing : 0});
    if (!page) {
        throw InputError(fmt::format("{}: expected a report of knap with a place for the error",
                                     report_path(options.simplified).string()));
    }
    write_text_file(report_path(options.simplified), *page);
}

void evaluate_by_fans(const EvaluateOptions& options, const std::vector<fs::path>& originals) {
    const ThreadLimit limit(thread_count(options.threads));
    const std::unique_ptr<Progress> progress = make_progress(options.progress);
    std::uint64_t total = 0;
    for (const fs::path& original : originals) {
        total += open_source(original)->info().declared_count.value_or(0);
    }
    StageClock clock(*progress);
    const Evaluation found = clock.time("evaluate", total, [&](const auto& advance) {
        const FanSurface surface(simplified_points(options.simplified));
        return evaluate(originals, surface, thread_count(options.threads), advance);
    });
    print_line(describe_header());
    print_line(describe("fans", found));
    if (options.report) {
        put_into_report(options, found);
    }
}

}  // namespace

Command add_evaluate(CLI::App& root) {
    CLI::App* const command = root.add_subcommand(
        "evaluate", "how far the original points are from the simplified surface");
    const auto options = std::make_shared<EvaluateOptions>();
    command->add_option("ORIGINAL", options->original, "a file, folder or glob")
        ->type_name("")
        ->required();
    command->add_option("SIMPLIFIED", options->simplified, "an archive folder, or a file")
        ->type_name("")
        ->required();
    command
        ->add_option("--surface", options->surface,
                     "fans: triangles round each point, no mesh, the original is streamed;\n"
                     "mesh: CGAL's advancing front, in memory, where knap was built with it;\n"
                     "both: one line each")
        ->type_name("fans|mesh|both")
        ->capture_default_str();
    command->add_option("--threads", options->threads, "threads; 0: one a core")
        ->type_name("INTEGER");
    command->add_flag("--report", options->report,
                      "also put the error into the report of SIMPLIFIED");
    add_progress_options(*command, options->progress);
    command->footer(
        "Prints mean, root mean square, 99th percentile and largest distance from the original\n"
        "points to the surface, over the diagonal of the original's box; for a mesh also the D of\n"
        "Yang et al. 2015.\n\n"
        "Example:\n  knap evaluate scan.ply scan_archive");
    return {command, [options] {
                const bool fans = options->surface != "mesh";
                const bool mesh = options->surface != "fans";
                if ((fans && mesh) != (options->surface == "both")) {
                    throw ConfigError(fmt::format(
                        "--surface: expected fans, mesh or both, found \"{}\"", options->surface));
                }
                if (options->threads < 0 || options->threads > 1024) {
                    throw ConfigError(
                        fmt::format("--threads: expected 0 .. 1024, found {}", options->threads));
                }
                if (options->report && !fans) {
                    throw ConfigError("--report: expected --surface fans or both, found mesh");
                }
                if (options->report) {
                    read_report(*options);
                }
                if (mesh && !fs::exists(mesh_program())) {
                    throw ConfigError(
                        fmt::format("--surface {}: expected {}, which is built where CGAL is "
                                    "found, found none",
                                    options->surface, mesh_program().string()));
                }
                const std::vector<fs::path> originals = expand_sources({options->original});
                if (fans) {
                    evaluate_by_fans(*options, originals);
                }
                if (mesh) {
                    if (!fans) {
                        print_line(describe_header());
                    }
                    run_mesh_program(*options, originals);
                }
            }};
}

}  // namespace knap::app
