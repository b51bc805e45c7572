#pragma once

#include <filesystem>
#include <string>
#include <vector>

/// The record of what a job has finished: a text file in the scratch folder, one line an entry.
///
///     line  checksum:16 hex digits, space, stage, tab, file, tab, JSON, newline
///
/// The checksum is XXH3-64 of the rest of the line. An entry is written after everything that it
/// names is in place. A last line that is torn does not count. Prose: docs/formats.md.
namespace knap {

/// One finished step.
struct JournalEntry {
    std::string stage;    ///< "survey", "plan", "scatter", "rank", "merge", "emit"
    std::string file;     ///< what it produced, relative to the scratch folder; may be empty
    std::string details;  ///< JSON of one line
    friend bool operator==(const JournalEntry&, const JournalEntry&) = default;
};

/// Appends an entry.
/// @throws StorageError
void append_to_journal(const std::filesystem::path& path, const JournalEntry& entry);

/// All entries in the order they were written; none if there is no file.
/// @throws StorageError if the file cannot be read, or a line other than a torn last one fails its
///         checksum
std::vector<JournalEntry> read_journal(const std::filesystem::path& path);

}  // namespace knap
