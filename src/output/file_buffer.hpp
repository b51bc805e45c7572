#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <streambuf>
#include <vector>

#include "base/file.hpp"

namespace knap {

/// The end of a file as a stream, for a library that writes to streams and goes back to put a
/// number right.
class FileBuffer final : public std::streambuf {
  public:
    /// @param file  outlives the buffer
    explicit FileBuffer(AtomicFile& file) : file_(file) {}

    /// The next byte goes to the end of the file.
    void start();

    /// Rethrows what went wrong with the file, if something did: a stream only knows that.
    void rethrow_error() const;

  protected:
    int_type overflow(int_type character) override;
    std::streamsize xsputn(const char* from, std::streamsize count) override;
    int sync() override;
    pos_type seekoff(off_type offset, std::ios_base::seekdir direction,
                     std::ios_base::openmode which) override;
    pos_type seekpos(pos_type position, std::ios_base::openmode which) override;

  private:
    bool flush();

    AtomicFile& file_;
    std::uint64_t position_ = 0;  // in the file, of the first byte held
    std::vector<std::byte> held_;
    std::exception_ptr error_;
};

}  // namespace knap
