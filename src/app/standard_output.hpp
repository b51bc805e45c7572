#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "base/scratch.hpp"
#include "knap/params.hpp"

namespace knap::app {

/// The output that means standard output.
constexpr const char* kStandardOutput = "-";

/// `--format`: as what a cloud goes to standard output.
struct StreamOptions {
    std::string format;  ///< "ply", "xyz"; empty: not given, which is "ply"
};

void add_stream_options(CLI::App& command, StreamOptions& options);

/// True if an output is standard output.
/// @throws ConfigError if a format is given for another output
bool is_standard_output(const std::string& path, const StreamOptions& options);

/// Standard output as a file: what is written goes on only when it is whole, so that a reader gets
/// all of a cloud or nothing.
class StandardOutput {
  public:
    /// @param folder  made here, and held by one process at a time
    /// @throws StorageError if it cannot be made or another process has it
    StandardOutput(const std::filesystem::path& folder, const StreamOptions& options);

    const std::filesystem::path& folder() const { return folder_.path(); }
    const std::filesystem::path& file() const { return file_; }

    /// Whether the folder outlives the object; it does not at first.
    void keep(bool keep) { folder_.keep(keep); }

    /// Writes the file to standard output.
    /// @throws StorageError if that is closed or full
    void give() const;

  private:
    ScratchFolder folder_;
    std::filesystem::path file_;
};

/// If the job writes to standard output, the file that it is to write instead, of which the job
/// then knows. Its folder, which is the job's scratch too, lies in resources.scratch, or else in
/// the system's folder for temporary files; a job that is resumed with the same input and
/// parameters finds it under the same name.
/// @throws ConfigError if the job wants a report, which would lie beside a file
std::unique_ptr<StandardOutput> take_standard_output(Job& job, const StreamOptions& options);

/// Lets a job that is only planned know where it would work if it writes to standard output.
void plan_standard_output(Job& job);

/// A folder for a file that no other process writes.
std::filesystem::path folder_of_this_process();

}  // namespace knap::app
