#include "output/file_buffer.hpp"

#include <algorithm>
#include <span>

namespace knap {

namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 18;

}  // namespace

void FileBuffer::start() {
    position_ = file_.size();
    held_.reserve(kBufferBytes);
}

void FileBuffer::rethrow_error() const {
    if (error_) {
        std::rethrow_exception(error_);
    }
}

FileBuffer::int_type FileBuffer::overflow(int_type character) {
    if (traits_type::eq_int_type(character, traits_type::eof())) {
        return flush() ? traits_type::not_eof(character) : traits_type::eof();
    }
    const char byte = traits_type::to_char_type(character);
    return xsputn(&byte, 1) == 1 ? character : traits_type::eof();
}

std::streamsize FileBuffer::xsputn(const char* from, std::streamsize count) {
    if (error_) {
        return 0;
    }
    const auto bytes = std::as_bytes(std::span(from, static_cast<std::size_t>(count)));
    held_.insert(held_.end(), bytes.begin(), bytes.end());
    return held_.size() < kBufferBytes || flush() ? count : 0;
}

int FileBuffer::sync() {
    return flush() ? 0 : -1;
}

FileBuffer::pos_type FileBuffer::seekoff(off_type offset, std::ios_base::seekdir direction,
                                         std::ios_base::openmode which) {
    const std::uint64_t here = position_ + held_.size();
    if (direction == std::ios_base::cur) {
        return offset == 0 ? pos_type(static_cast<off_type>(here))
                           : seekpos(static_cast<off_type>(here) + offset, which);
    }
    if (direction == std::ios_base::end) {
        return flush() ? seekpos(static_cast<off_type>(file_.size()) + offset, which)
                       : pos_type(off_type(-1));
    }
    return seekpos(offset, which);
}

FileBuffer::pos_type FileBuffer::seekpos(pos_type position, std::ios_base::openmode /*which*/) {
    const auto to = static_cast<off_type>(position);
    if (!flush() || to < 0 || static_cast<std::uint64_t>(to) > file_.size()) {
        return {off_type(-1)};
    }
    position_ = static_cast<std::uint64_t>(to);
    return position;
}

bool FileBuffer::flush() {
    if (error_) {
        return false;
    }
    try {
        const std::span<const std::byte> bytes(held_);
        const auto inside = static_cast<std::size_t>(
            std::min<std::uint64_t>(bytes.size(), file_.size() - position_));
        file_.write_at(position_, bytes.first(inside));
        file_.write(bytes.subspan(inside));
        position_ += bytes.size();
        held_.clear();
        return true;
    } catch (...) {
        error_ = std::current_exception();
        return false;
    }
}

}  // namespace knap
