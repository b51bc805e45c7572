#pragma once

#include <cstdint>
#include <exception>
#include <span>
#include <streambuf>
#include <vector>

#include "base/file.hpp"

namespace knap {

/// A part of a file behind bytes of our own, as one stream: it lets a decoder that wants a whole
/// file see one chunk of it and nothing else.
class LazStreamBuffer final : public std::streambuf {
  public:
    /// @param file  outlives the stream; its bytes [begin, end) follow `head`
    LazStreamBuffer(std::vector<std::byte> head, const InputFile& file, std::uint64_t begin,
                    std::uint64_t end);

    /// Bytes behind the place that has been read up to.
    std::uint64_t remaining() const;

    /// Rethrows what went wrong with the file, if something did: a stream only knows an end.
    void rethrow_error() const;

  protected:
    int_type underflow() override;
    pos_type seekoff(off_type offset, std::ios_base::seekdir direction,
                     std::ios_base::openmode which) override;
    pos_type seekpos(pos_type position, std::ios_base::openmode which) override;

  private:
    std::uint64_t size() const { return head_.size() + (end_ - begin_); }
    std::uint64_t position() const {
        return window_begin_ + static_cast<std::uint64_t>(gptr() - eback());
    }

    std::vector<std::byte> head_;
    const InputFile& file_;
    std::uint64_t begin_;
    std::uint64_t end_;
    std::vector<std::byte> block_;
    std::uint64_t window_begin_ = 0;  // place in the stream of the get area
    std::exception_ptr error_;
};

}  // namespace knap
