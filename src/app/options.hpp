#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "knap/params.hpp"

namespace knap::app {

/// The parameters of a job as flags of a command: one for every row of the table. Must outlive the
/// parsing.
class JobOptions {
  public:
    /// How a command names what it reads.
    enum class Input {
        kFiles,       ///< simplify IN...
        kJob,         ///< run JOB.toml, with --input to replace its input
        kJobOrFiles,  ///< plan JOB.toml or plan IN...
    };

    JobOptions(CLI::App& command, Input input);
    JobOptions(const JobOptions&) = delete;
    JobOptions& operator=(const JobOptions&) = delete;

    /// The job: file first, then --preset, then --set, then flags.
    /// @throws ConfigError, InputError
    Job job() const;

  private:
    void add_flags(CLI::App& command);
    bool gives_target() const;

    Input input_;
    std::vector<std::string> positional_;
    std::vector<std::string> input_flags_;
    std::vector<std::string> settings_;
    std::string preset_;
    bool resume_ = false;
    bool restart_ = false;
    std::vector<std::string> texts_;   ///< a row of the table each
    std::vector<CLI::Option*> flags_;  ///< the same; none for the input
};

/// How a command shows its progress.
struct ProgressOptions {
    std::string mode = "auto";
    bool quiet = false;
};

void add_progress_options(CLI::App& command, ProgressOptions& options);

/// `-o, --output FILE` and `--overwrite` of commands that write one file.
struct OutputFileOptions {
    std::string path;
    bool overwrite = false;
};

void add_output_file_options(CLI::App& command, OutputFileOptions& options,
                             const std::string& endings);

/// Makes sure, before any work, that a file can be written.
/// @throws ConfigError if it exists and may not be replaced, or its folder cannot be written to
void check_output_file(const OutputFileOptions& options);

}  // namespace knap::app
