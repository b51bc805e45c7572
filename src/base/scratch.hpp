#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>

namespace knap {

/// A job's working folder, which no other process works in while the object lives. Removed with
/// all in it when the object goes, unless it is to be kept.
class ScratchFolder {
  public:
    /// Creates the folder, or takes up the one that an earlier run left.
    /// @throws StorageError if it cannot be created, or another process works in it
    explicit ScratchFolder(std::filesystem::path path);
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

    /// Removes what is in the folder, and counts from nothing again.
    /// @throws StorageError
    void clear();

    /// Whether what is in the folder outlives the object; it does not at first.
    void keep(bool keep) { keep_ = keep; }
    bool is_kept() const { return keep_; }

    /// To be told how many bytes a file in the folder grew by, or gave back. Thread-safe.
    void grew_by(std::int64_t bytes);
    /// Counts what is there.
    void recount();
    std::uint64_t used_bytes() const { return static_cast<std::uint64_t>(used_.load()); }
    std::uint64_t peak_bytes() const { return static_cast<std::uint64_t>(peak_.load()); }

  private:
    void lock();

    std::filesystem::path path_;
    int lock_ = -1;
    bool keep_ = false;
    std::atomic<std::int64_t> used_{0};
    std::atomic<std::int64_t> peak_{0};
};

/// Bytes that an ordinary user can still write below `folder`, which need not exist yet.
std::uint64_t free_bytes(const std::filesystem::path& folder);

/// Largest resident memory of this process so far.
std::uint64_t peak_resident_bytes();

/// Resident memory of this process now.
std::uint64_t resident_bytes();

}  // namespace knap
