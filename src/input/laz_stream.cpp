#include "input/laz_stream.hpp"

#include <algorithm>
#include <utility>

namespace knap {

namespace {

constexpr std::size_t kBlock = std::size_t{1} << 16;

}  // namespace

LazStreamBuffer::LazStreamBuffer(std::vector<std::byte> head, const InputFile& file,
                                 std::uint64_t begin, std::uint64_t end)
    : head_(std::move(head)), file_(file), begin_(begin), end_(end) {}

std::uint64_t LazStreamBuffer::remaining() const {
    return size() - position();
}

void LazStreamBuffer::rethrow_error() const {
    if (error_) {
        std::rethrow_exception(error_);
    }
}

LazStreamBuffer::int_type LazStreamBuffer::underflow() {
    const std::uint64_t place = position();
    const auto show = [&](std::byte* first, std::size_t n) {
        char* begin = reinterpret_cast<char*>(first);
        setg(begin, begin, begin + n);
        window_begin_ = place;
        return traits_type::to_int_type(*begin);
    };
    if (place < head_.size()) {
        return show(head_.data() + place, head_.size() - place);
    }
    if (place >= size()) {
        return traits_type::eof();
    }
    try {
        const std::uint64_t offset = begin_ + (place - head_.size());
        block_.resize(kBlock);
        const std::size_t wanted =
            static_cast<std::size_t>(std::min<std::uint64_t>(kBlock, end_ - offset));
        const std::size_t got = file_.read_some(offset, std::span(block_).first(wanted));
        return got > 0 ? show(block_.data(), got) : traits_type::eof();
    } catch (...) {
        error_ = std::current_exception();
        return traits_type::eof();
    }
}

LazStreamBuffer::pos_type LazStreamBuffer::seekoff(off_type offset,
                                                   std::ios_base::seekdir direction,
                                                   std::ios_base::openmode which) {
    const std::uint64_t base = direction == std::ios_base::beg   ? 0
                               : direction == std::ios_base::cur ? position()
                                                                 : size();
    if (direction == std::ios_base::cur && offset == 0) {
        return {static_cast<off_type>(base)};
    }
    return seekpos(pos_type(static_cast<off_type>(base) + offset), which);
}

LazStreamBuffer::pos_type LazStreamBuffer::seekpos(pos_type position,
                                                   std::ios_base::openmode /*which*/) {
    const auto place = static_cast<off_type>(position);
    if (place < 0 || static_cast<std::uint64_t>(place) > size()) {
        return pos_type(off_type{-1});
    }
    setg(nullptr, nullptr, nullptr);
    window_begin_ = static_cast<std::uint64_t>(place);
    return position;
}

}  // namespace knap
