#pragma once

#include <cstdint>
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

/// What a journal says.
struct Journal {
    std::vector<JournalEntry> entries;  ///< in the order they were written
    std::uint64_t whole_bytes = 0;      ///< the size of the file up to the last whole line
    bool damaged = false;               ///< lines from there on are other than a torn last one
};

/// Reads up to the first line that is torn or fails its checksum; nothing if there is no file.
/// @throws StorageError if the file cannot be read
Journal read_journal(const std::filesystem::path& path);

}  // namespace knap
