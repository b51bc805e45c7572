#include "base/scratch.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "knap/error.hpp"

namespace knap {

namespace fs = std::filesystem;

ScratchFolder::ScratchFolder(const fs::path& parent) {
    std::error_code error;
    fs::create_directories(parent, error);
    for (int attempt = 0; !error; ++attempt) {
        path_ = parent / fmt::format("knap-{}-{}", ::getpid(), attempt);
        if (fs::create_directory(path_, error)) {
            return;
        }
    }
    throw StorageError(
        fmt::format("{}: cannot create a scratch folder: {}", parent.string(), error.message()));
}

ScratchFolder::~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
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
