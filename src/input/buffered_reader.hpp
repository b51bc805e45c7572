#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/file.hpp"

namespace knap {

/// Reads a file forward in small or large pieces through a buffer of bounded size.
class BufferedReader {
  public:
    static constexpr std::size_t kCapacity = std::size_t{1} << 20;

    /// @param file  outlives the reader
    explicit BufferedReader(const InputFile& file) : file_(file) {}

    /// Place in the file of the next byte.
    std::uint64_t offset() const { return offset_; }
    std::uint64_t remaining() const { return offset_ < file_.size() ? file_.size() - offset_ : 0; }

    /// Is there no byte left? Of a decoded file remaining() is no more than a bound.
    /// @throws InputError if the file ends before the place where the reader stands
    bool at_end();

    void seek(std::uint64_t offset);
    void skip(std::uint64_t bytes) { seek(offset_ + bytes); }

    /// The next `bytes` <= kCapacity bytes, valid until the next call.
    /// @throws InputError if the file ends before
    const std::byte* take(std::size_t bytes) {
        if (buffer_end_ - position_ < bytes) {
            refill(bytes);
        }
        const std::byte* taken = buffer_.data() + position_;
        position_ += bytes;
        offset_ += bytes;
        return taken;
    }

  private:
    void refill(std::size_t bytes);
    std::size_t fill();

    const InputFile& file_;
    std::vector<std::byte> buffer_;
    std::size_t position_ = 0;
    std::size_t buffer_end_ = 0;
    std::uint64_t offset_ = 0;
};

}  // namespace knap
