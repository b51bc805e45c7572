#pragma once

#include <filesystem>

namespace knap {

/// A folder that appears under its name whole or not at all: filled beside it under a temporary
/// name and renamed by commit(). Without commit() it leaves nothing behind.
class OutputFolder {
  public:
    /// Creates `target`.partial, in the place of one that an earlier job left.
    /// @throws StorageError if it cannot be created
    explicit OutputFolder(std::filesystem::path target);
    ~OutputFolder();
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;

    /// The folder to fill.
    const std::filesystem::path& path() const { return partial_; }

    /// Renames the folder to its name.
    /// @param overwrite  replace an archive that is there; it is gone only after the new one is in
    ///                   its place. A folder that is no archive is never replaced.
    /// @throws StorageError
    void commit(bool overwrite);

  private:
    std::filesystem::path target_;
    std::filesystem::path partial_;
    bool committed_ = false;
};

}  // namespace knap
