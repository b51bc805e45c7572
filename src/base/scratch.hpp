#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>

namespace knap {

/// A folder of its own for a job's working files; removed with all in it when the object goes.
class ScratchFolder {
  public:
    /// Creates `parent`/knap-<process>-<n>.
    /// @throws StorageError if it cannot be created
    explicit ScratchFolder(const std::filesystem::path& parent);
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

    /// To be told how many bytes a file in the folder grew by, or gave back. Thread-safe.
    void grew_by(std::int64_t bytes);
    std::uint64_t peak_bytes() const { return static_cast<std::uint64_t>(peak_.load()); }

  private:
    std::filesystem::path path_;
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
