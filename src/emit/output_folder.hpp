#pragma once

#include <filesystem>

#include "emit/output_check.hpp"

namespace knap {

/// A folder that appears under its name whole or not at all: filled beside it under a temporary
/// name and renamed by commit().
class OutputFolder {
  public:
    /// What becomes of the folder under its temporary name without commit().
    enum class Unfinished {
        kGoes,  ///< nothing is left behind, and what an earlier job left is gone
        kStays  ///< it stays, and what an earlier job left is taken up
    };

    /// Whether a folder holds nothing but what knap puts there, and may remove.
    using IsOurs = bool (*)(const std::filesystem::path& folder);

    /// Creates `target`.partial.
    /// @param is_ours  of the folders that may be in the way
    /// @throws StorageError if it cannot be created, or holds other files
    explicit OutputFolder(std::filesystem::path target, Unfinished unfinished = Unfinished::kGoes,
                          IsOurs is_ours = holds_only_archive);
    ~OutputFolder();
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;

    /// The folder to fill.
    const std::filesystem::path& path() const { return partial_; }

    /// Removes what an earlier job left in it.
    /// @throws StorageError
    void clear();

    /// Renames the folder to its name.
    /// @param overwrite  replace what is there; it is gone only after the new folder is in its
    ///                   place. A folder that is not knap's is never replaced.
    /// @throws StorageError
    void commit(bool overwrite);

  private:
    std::filesystem::path target_;
    std::filesystem::path partial_;
    Unfinished unfinished_;
    IsOurs is_ours_;
    bool committed_ = false;
};

/// Removes what an unfinished archive left beside its name.
/// @throws StorageError if files are in the way that are not of an archive
void remove_unfinished(const std::filesystem::path& target);

}  // namespace knap
