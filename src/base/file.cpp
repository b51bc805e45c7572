#include "base/file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "knap/error.hpp"

namespace knap {

namespace {

constexpr mode_t kMode = 0666;

std::string reason() {
    return std::strerror(errno);
}

[[noreturn]] void throw_storage(const char* what, const std::filesystem::path& path) {
    throw StorageError(fmt::format("{}: cannot {}: {}", path.string(), what, reason()));
}

void write_all(int descriptor, std::span<const std::byte> bytes,
               const std::filesystem::path& path) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
        if (written < 0) {
            if (errno == EINTR) {
                continue;
            }
            throw_storage("write", path);
        }
        bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
}

}  // namespace

InputFile::InputFile(std::filesystem::path path) : path_(std::move(path)) {
    descriptor_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor_ < 0) {
        throw InputError(fmt::format("{}: cannot open: {}", path_.string(), reason()));
    }
    struct stat status {};
    if (::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
        ::close(descriptor_);
        throw InputError(fmt::format("{}: expected a regular file", path_.string()));
    }
    size_ = static_cast<std::uint64_t>(status.st_size);
}

InputFile::~InputFile() {
    if (descriptor_ >= 0) {
        ::close(descriptor_);
    }
}

InputFile::InputFile(InputFile&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_),
      content_(std::move(other.content_)) {}

InputFile::InputFile(InputFile file, std::unique_ptr<DecodedContent> content)
    : InputFile(std::move(file)) {
    content_ = std::move(content);
}

std::size_t InputFile::read_some(std::uint64_t offset, std::span<std::byte> buffer) const {
    if (content_) {
        return content_->read_some(offset, buffer);
    }
    std::size_t total = 0;
    while (total < buffer.size()) {
        const ssize_t got = ::pread(descriptor_, buffer.data() + total, buffer.size() - total,
                                    static_cast<off_t>(offset + total));
        if (got < 0) {
            if (errno == EINTR) {
                continue;
            }
            throw InputError(fmt::format("{}: cannot read at byte {}: {}", path_.string(),
                                         offset + total, reason()));
        }
        if (got == 0) {
            break;
        }
        total += static_cast<std::size_t>(got);
    }
    return total;
}

AtomicFile::AtomicFile(std::filesystem::path path, Durability durability)
    : path_(std::move(path)), temporary_(path_.string() + ".partial"), durability_(durability) {
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode);
    if (descriptor_ < 0) {
        throw_storage("create", path_);
    }
}

AtomicFile::~AtomicFile() {
    if (descriptor_ >= 0) {
        ::close(descriptor_);
        ::unlink(temporary_.c_str());
    }
}

void AtomicFile::write(std::span<const std::byte> bytes) {
    write_all(descriptor_, bytes, path_);
    size_ += bytes.size();
}

void AtomicFile::write(std::string_view text) {
    write(std::as_bytes(std::span(text.data(), text.size())));
}

void AtomicFile::write_at(std::uint64_t offset, std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t written =
            ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
        if (written < 0 && errno != EINTR) {
            throw_storage("write", path_);
        }
        const auto done = static_cast<std::size_t>(std::max<ssize_t>(written, 0));
        bytes = bytes.subspan(done);
        offset += done;
    }
}

void AtomicFile::commit() {
    if (durability_ == Durability::kMachine && ::fsync(descriptor_) != 0) {
        throw_storage("sync", path_);
    }
    if (::close(std::exchange(descriptor_, -1)) != 0 ||
        ::rename(temporary_.c_str(), path_.c_str()) != 0) {
        const int error = errno;
        ::unlink(temporary_.c_str());
        errno = error;
        throw_storage("finish", path_);
    }
    if (durability_ == Durability::kMachine) {
        sync_folder(path_.parent_path());
    }
}

void sync_folder(const std::filesystem::path& folder) {
    const std::string name = folder.empty() ? "." : folder.string();
    const int descriptor = ::open(name.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor >= 0) {
        ::fsync(descriptor);
        ::close(descriptor);
    }
}

void append_to_file(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, kMode);
    if (descriptor < 0) {
        throw_storage("open", path);
    }
    try {
        write_all(descriptor, bytes, path);
    } catch (...) {
        ::close(descriptor);
        throw;
    }
    if (::close(descriptor) != 0) {
        throw_storage("close", path);
    }
}

std::string read_text_file(const std::filesystem::path& path) {
    const InputFile file(path);
    std::string text(file.size(), '\0');
    text.resize(file.read_some(0, std::as_writable_bytes(std::span(text.data(), text.size()))));
    return text;
}

void write_text_file(const std::filesystem::path& path, std::string_view text) {
    AtomicFile file(path);
    file.write(text);
    file.commit();
}

std::string format_bytes(std::uint64_t bytes) {
    constexpr std::array kUnits{"B", "KiB", "MiB", "GiB", "TiB"};
    auto value = static_cast<double>(bytes);
    std::size_t unit = 0;
    while (value >= 1024 && unit + 1 < kUnits.size()) {
        value /= 1024;
        ++unit;
    }
    return unit == 0 ? fmt::format("{} B", bytes) : fmt::format("{:.2f} {}", value, kUnits[unit]);
}

}  // namespace knap
