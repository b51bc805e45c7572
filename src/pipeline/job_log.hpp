#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace knap {

/// A brick or a tile, as the log and the names of files have it: six digits.
std::string number_name(std::size_t number);

/// What a job has finished: the journal in its scratch folder, by stage and file. Reading it back
/// is how a job goes on where an earlier run stopped.
class JobLog {
  public:
    /// Reads what an earlier run recorded. A torn last line is cut off: its step was not finished.
    /// @throws StorageError if the file cannot be read or cut
    explicit JobLog(std::filesystem::path path);

    /// True if lines were lost that had been whole: what they named may be gone.
    bool is_damaged() const { return damaged_; }

    /// The details of a finished step; null if it was not finished.
    const nlohmann::ordered_json* find(const std::string& stage,
                                       const std::string& file = "") const;

    /// Files and details of all finished steps of a stage, by file.
    std::vector<std::pair<std::string, const nlohmann::ordered_json*>> all(
        const std::string& stage) const;

    /// Adds a finished step. Everything that it names must be in place.
    /// @throws StorageError
    void record(const std::string& stage, const std::string& file, nlohmann::ordered_json details);

    /// Forgets everything.
    void clear();

  private:
    std::filesystem::path path_;
    bool damaged_ = false;
    std::map<std::pair<std::string, std::string>, nlohmann::ordered_json> entries_;
};

}  // namespace knap
