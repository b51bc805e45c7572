#pragma once

#include <filesystem>
#include <memory>

#include "knap/job.hpp"

namespace knap::app {

/// Standard input as a file, which a job can read more than once; gone with the object.
class StandardInput {
  public:
    /// Reads all there is.
    /// @param file  does not exist, or is left from an earlier run
    /// @throws StorageError if it cannot be written
    /// @throws InputError if standard input cannot be read
    /// @throws Interrupted if a signal comes
    explicit StandardInput(std::filesystem::path file);
    ~StandardInput();
    StandardInput(const StandardInput&) = delete;
    StandardInput& operator=(const StandardInput&) = delete;

    const std::filesystem::path& file() const { return file_; }

  private:
    std::filesystem::path file_;
};

/// If the job reads standard input, its copy, which the job then knows of. It lies beside the
/// scratch folder, so that a job that is resumed with the same input finds it under the same name.
std::unique_ptr<StandardInput> take_standard_input(Job& job, Progress& progress);

}  // namespace knap::app
