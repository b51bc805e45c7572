#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace knap {

/// What a file decodes to, read in place of what it holds.
class DecodedContent {
  public:
    virtual ~DecodedContent() = default;

    /// As InputFile::read_some(), best asked for in ascending order.
    virtual std::size_t read_some(std::uint64_t offset, std::span<std::byte> buffer) = 0;
};

/// A file open for reading at any place; closed with the object. Thread-safe, unless it is decoded.
class InputFile {
  public:
    /// The size of decoded content, which is known only at its end: beyond that of any file.
    static constexpr std::uint64_t kUnknownSize = std::uint64_t{1} << 62U;

    /// @throws InputError if the file is missing, a folder or unreadable, naming it and the reason
    explicit InputFile(std::filesystem::path path);
    /// The same file, read as what it decodes to.
    InputFile(InputFile file, std::unique_ptr<DecodedContent> content);
    ~InputFile();
    InputFile(InputFile&& other) noexcept;
    InputFile& operator=(InputFile&&) = delete;

    const std::filesystem::path& path() const { return path_; }
    /// Bytes that can be read, or kUnknownSize.
    std::uint64_t size() const { return content_ ? kUnknownSize : size_; }
    bool size_known() const { return content_ == nullptr; }
    std::uint64_t size_on_disk() const { return size_; }

    /// Reads up to buffer.size() bytes at `offset`.
    /// @return bytes read; fewer than asked only at the end of the file
    /// @throws InputError if the system cannot read
    std::size_t read_some(std::uint64_t offset, std::span<std::byte> buffer) const;

  private:
    std::filesystem::path path_;
    int descriptor_ = -1;
    std::uint64_t size_ = 0;
    std::unique_ptr<DecodedContent> content_;
};

/// A file that appears under its name whole or not at all: written beside it under a temporary
/// name, synced and renamed by commit(). Without commit() it leaves nothing behind.
class AtomicFile {
  public:
    /// What a committed file outlives: the death of the process (scratch files, which carry
    /// checksums), or of the machine too.
    enum class Durability { kProcess, kMachine };

    /// @throws StorageError if the file cannot be created
    explicit AtomicFile(std::filesystem::path path, Durability durability = Durability::kMachine);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    /// @throws StorageError if the disk is full or fails
    void write(std::span<const std::byte> bytes);
    void write(std::string_view text);

    /// Replaces what was written before.
    /// @param offset  offset + bytes.size() <= size()
    /// @throws StorageError
    void write_at(std::uint64_t offset, std::span<const std::byte> bytes);

    /// Bytes written so far.
    std::uint64_t size() const { return size_; }

    /// Syncs, renames and syncs the folder (kProcess: renames).
    /// @throws StorageError
    void commit();

  private:
    std::filesystem::path path_;
    std::filesystem::path temporary_;
    Durability durability_;
    int descriptor_ = -1;
    std::uint64_t size_ = 0;
};

/// Appends to a file, which is created if it is not there; opens and closes it, so that any number
/// of files can grow side by side.
/// @throws StorageError if the disk is full or fails
void append_to_file(const std::filesystem::path& path, std::span<const std::byte> bytes);

/// Makes what was renamed in a folder outlive the machine, as far as its file system can.
void sync_folder(const std::filesystem::path& folder);

/// The whole of a small file.
/// @throws InputError if it cannot be read
std::string read_text_file(const std::filesystem::path& path);

/// Writes a small file atomically.
/// @throws StorageError
void write_text_file(const std::filesystem::path& path, std::string_view text);

/// Bytes as text with a binary unit: "1.5 GiB".
std::string format_bytes(std::uint64_t bytes);

}  // namespace knap
