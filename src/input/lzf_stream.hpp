#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "input/buffered_reader.hpp"

namespace knap {

/// Decompresses LZF data from its start on, in pieces, with no more of it in memory than a match
/// can reach back: 8 KiB. A copy goes on from where the original stands.
///
/// LZF is a run of two things: a byte below 32, followed by that many literal bytes and one more;
/// or a match, three bits of length and thirteen of distance, the length going on in a byte of its
/// own where the three bits are all ones.
class LzfStream {
  public:
    /// @param file   outlives the stream
    /// @param begin  place of the compressed data in the file
    /// @param bytes  its length
    LzfStream(const InputFile& file, std::uint64_t begin, std::uint64_t bytes);

    /// The next out.size() decompressed bytes.
    /// @throws InputError if the data ends before, or refers to what is before its start
    void read(std::span<std::byte> out);

    /// Goes over the next `bytes` decompressed bytes.
    void skip(std::uint64_t bytes);

  private:
    static constexpr std::size_t kReach = std::size_t{1} << 13;

    std::uint8_t next_byte();
    void start_run();
    void put(std::byte value) { window_[produced_++ % kReach] = value; }
    [[noreturn]] void fail(const char* found) const;

    const InputFile* file_;
    BufferedReader reader_;
    std::uint64_t end_;
    std::array<std::byte, kReach> window_{};
    std::uint64_t produced_ = 0;
    std::size_t literals_ = 0;  // left of the run
    std::size_t match_ = 0;     // left of the match
    std::size_t distance_ = 0;
};

}  // namespace knap
