#include "input/line_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <span>

#include "knap/error.hpp"

namespace knap {

namespace {

constexpr std::size_t kFirstCapacity = std::size_t{1} << 18;

}  // namespace

LineReader::LineReader(const InputFile& file, std::uint64_t offset, std::uint64_t first_line)
    : file_(file), offset_(offset), line_number_(first_line - 1) {}

bool LineReader::refill() {
    if (begin_ == 0 && end_ == buffer_.size()) {
        if (buffer_.size() >= kLongestLine) {
            throw InputError(
                fmt::format("{}: line {}: expected at most {} bytes in a line, found more",
                            file_.path().string(), line_number_ + 1, kLongestLine));
        }
        buffer_.resize(buffer_.empty() ? kFirstCapacity : buffer_.size() * 2);
    }
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
    const std::size_t got =
        file_.read_some(offset_, std::as_writable_bytes(std::span(buffer_).subspan(end_)));
    offset_ += got;
    end_ += got;
    return got > 0;
}

bool LineReader::next(std::string_view& line) {
    if (after_return_) {
        if (begin_ == end_ && !refill()) {
            return false;
        }
        begin_ += buffer_[begin_] == '\n' ? 1 : 0;
        after_return_ = false;
    }
    std::size_t scanned = 0;
    for (;;) {
        const char* first = buffer_.data() + begin_;
        const char* last = buffer_.data() + end_;
        const char* stop = first + scanned;
        while (stop != last && *stop != '\n' && *stop != '\r') {
            ++stop;
        }
        scanned = static_cast<std::size_t>(stop - first);
        if (stop != last) {
            after_return_ = *stop == '\r';
            begin_ += scanned + 1;
        } else if (refill()) {
            continue;
        } else if (scanned == 0) {
            return false;
        } else {
            first = buffer_.data() + begin_;
            begin_ = end_;
        }
        line = std::string_view(first, scanned);
        ++line_number_;
        return true;
    }
}

bool LineReader::next_with_text(std::string_view& line) {
    while (next(line)) {
        if (!is_blank(line)) {
            return true;
        }
    }
    return false;
}

bool is_blank(std::string_view line) {
    return line.find_first_not_of(" \t\f\v") == std::string_view::npos;
}

}  // namespace knap
