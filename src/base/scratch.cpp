#include "base/scratch.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include "knap/error.hpp"

namespace knap {

namespace fs = std::filesystem;

namespace {

constexpr const char* kLockFile = "lock";

}  // namespace

ScratchFolder::ScratchFolder(fs::path path) : path_(std::move(path)) {
    std::error_code error;
    fs::create_directories(path_, error);
    if (error) {
        throw StorageError(
            fmt::format("{}: cannot create a scratch folder: {}", path_.string(), error.message()));
    }
    lock();
    for (const auto& entry : fs::recursive_directory_iterator(path_, error)) {
        used_ +=
            entry.is_regular_file(error) ? static_cast<std::int64_t>(entry.file_size(error)) : 0;
    }
    peak_ = used_.load();
}

ScratchFolder::~ScratchFolder() {
    if (!keep_) {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    ::close(lock_);
}

// The system gives the lock back however the process ends.
void ScratchFolder::lock() {
    constexpr mode_t kMode = 0644;
    const fs::path file = path_ / kLockFile;
    lock_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kMode);
    if (lock_ < 0) {
        throw StorageError(
            fmt::format("{}: cannot create: {}", file.string(), std::strerror(errno)));
    }
    if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
        const bool taken = errno == EWOULDBLOCK;
        const std::string reason = taken ? "another run of knap works on this output"
                                         : fmt::format("cannot lock: {}", std::strerror(errno));
        ::close(lock_);
        throw StorageError(fmt::format("{}: {}", path_.string(), reason));
    }
}

void ScratchFolder::clear() {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(path_, error)) {
        if (entry.path().filename() != kLockFile) {
            fs::remove_all(entry.path(), error);
        }
        if (error) {
            throw StorageError(
                fmt::format("{}: cannot remove: {}", entry.path().string(), error.message()));
        }
    }
    used_ = 0;
    peak_ = 0;
}

void ScratchFolder::recount() {
    std::int64_t bytes = 0;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(path_, error)) {
        const std::uint64_t size = entry.file_size(error);
        bytes += error ? 0 : static_cast<std::int64_t>(size);
    }
    used_ = bytes;
    grew_by(0);
}

void ScratchFolder::grew_by(std::int64_t bytes) {
    const std::int64_t used = used_ += bytes;
    std::int64_t seen = peak_;
    while (seen < used && !peak_.compare_exchange_weak(seen, used)) {
    }
}

std::uint64_t free_bytes(const fs::path& folder) {
    fs::path existing = fs::absolute(folder);
    std::error_code error;
    while (!fs::exists(existing, error) && existing.has_relative_path()) {
        existing = existing.parent_path();
    }
    const fs::space_info space = fs::space(existing, error);
    return error ? 0 : space.available;
}

std::uint64_t peak_resident_bytes() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::uint64_t resident_bytes() {
    std::ifstream statm("/proc/self/statm");
    std::uint64_t size = 0;
    std::uint64_t resident = 0;
    statm >> size >> resident;
    return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace knap
