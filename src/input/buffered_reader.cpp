#include "input/buffered_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "knap/error.hpp"

namespace knap {

void BufferedReader::seek(std::uint64_t offset) {
    const std::uint64_t buffer_begin = offset_ - position_;
    if (offset >= buffer_begin && offset <= buffer_begin + buffer_end_) {
        position_ = static_cast<std::size_t>(offset - buffer_begin);
    } else {
        position_ = 0;
        buffer_end_ = 0;
    }
    offset_ = offset;
}

bool BufferedReader::at_end() {
    if (file_.size_known()) {
        return remaining() == 0;
    }
    if (offset_ > 0) {
        seek(offset_ - 1);
        take(1);
    }
    return position_ == buffer_end_ && fill() == 0;
}

/// Reads on behind what is left in the buffer.
/// @return bytes in the buffer
std::size_t BufferedReader::fill() {
    if (buffer_.empty()) {
        buffer_.resize(kCapacity);
    }
    const std::size_t kept = buffer_end_ - position_;
    std::memmove(buffer_.data(), buffer_.data() + position_, kept);
    position_ = 0;
    buffer_end_ = kept + file_.read_some(offset_ + kept, std::span(buffer_).subspan(kept));
    return buffer_end_;
}

void BufferedReader::refill(std::size_t bytes) {
    if (fill() < bytes) {
        throw InputError(
            fmt::format("{}: the data ends early: expected {} bytes at byte {}, found {}",
                        file_.path().string(), bytes, offset_, buffer_end_));
    }
}

}  // namespace knap
