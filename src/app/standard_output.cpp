#include "app/standard_output.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "app/interrupt.hpp"
#include "base/checksum.hpp"
#include "base/file.hpp"
#include "emit/emit.hpp"
#include "knap/error.hpp"

namespace knap::app {

namespace {

namespace fs = std::filesystem;

fs::path temporary_folder() {
    std::error_code error;
    fs::path folder = fs::temp_directory_path(error);
    if (error) {
        throw ConfigError(
            fmt::format("resources.scratch (--scratch): expected a folder, as the output is "
                        "standard output and the system's temporary folder is none ({})",
                        error.message()));
    }
    return folder;
}

/// The same for the same job, begun in the same place.
std::string folder_name(const Job& job, const StreamOptions& options) {
    std::string text = fmt::format("{}\n{}\n", fs::current_path().string(), options.format);
    for (const std::string& input : job.input) {
        text += input + "\n";
    }
    for (const auto& [key, value] : result_parameters(job)) {
        text += fmt::format("{}={}\n", key, value);
    }
    return fmt::format("knap-stdout-{:016x}", xxh3_64(std::as_bytes(std::span(text))));
}

void write_all(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(STDOUT_FILENO, bytes.data(), bytes.size());
        throw_if_interrupted();
        if (written < 0 && errno == EINTR) {
            continue;
        }
        if (written < 0) {
            throw StorageError(
                fmt::format("-: cannot write standard output: {}", std::strerror(errno)));
        }
        bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
}

}  // namespace

void add_stream_options(CLI::App& command, StreamOptions& options) {
    command
        .add_option("--format", options.format,
                    "with -o -: what goes to standard output, ply or xyz; default ply")
        ->type_name("NAME");
}

bool is_standard_output(const std::string& path, const StreamOptions& options) {
    const bool is_it = path == kStandardOutput;
    if (!options.format.empty() && !is_it) {
        throw ConfigError(fmt::format(
            "--format: expected -o - beside it, found -o {}: a file's ending says its format",
            path));
    }
    if (!options.format.empty() && options.format != "ply" && options.format != "xyz") {
        throw ConfigError(
            fmt::format("--format: expected one of ply, xyz, found {}", options.format));
    }
    return is_it;
}

StandardOutput::StandardOutput(const fs::path& folder, const StreamOptions& options)
    : folder_(folder),
      file_(folder / fmt::format("out.{}", options.format.empty() ? "ply" : options.format)) {}

void StandardOutput::give() const {
    constexpr std::size_t kBlock = std::size_t{1} << 20;
    // A reader that has gone is an error to be told, not the end of the process.
    std::signal(SIGPIPE, SIG_IGN);
    const InputFile file(file_);
    std::vector<std::byte> block(kBlock);
    for (std::uint64_t at = 0; at < file.size();) {
        const std::size_t got = file.read_some(at, block);
        write_all(std::span(block).first(got));
        at += got;
    }
}

std::unique_ptr<StandardOutput> take_standard_output(Job& job, const StreamOptions& options) {
    if (!is_standard_output(job.output.path, options)) {
        return nullptr;
    }
    if (job.output.report) {
        throw ConfigError(
            "output.report (--report): -: expected a folder or a file as output, beside which a "
            "report can lie");
    }
    const fs::path parent =
        job.resources.scratch.empty() ? temporary_folder() : fs::path(job.resources.scratch);
    auto output = std::make_unique<StandardOutput>(parent / folder_name(job, options), options);
    job.resources.scratch = output->folder().string();
    job.output.path = output->file().string();
    job.output.overwrite = true;
    return output;
}

void plan_standard_output(Job& job) {
    if (job.output.path != kStandardOutput) {
        return;
    }
    if (job.resources.scratch.empty()) {
        job.resources.scratch = temporary_folder().string();
    }
    job.output.path = (fs::path(job.resources.scratch) / "out.ply").string();
}

fs::path folder_of_this_process() {
    return temporary_folder() / fmt::format("knap-stdout-{}", ::getpid());
}

}  // namespace knap::app
