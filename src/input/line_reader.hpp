#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "base/file.hpp"

namespace knap {

/// Reads the lines of a text file; each ends in LF, CR LF, CR or with the file.
class LineReader {
  public:
    static constexpr std::size_t kLongestLine = std::size_t{1} << 20;

    /// @param file        outlives the reader
    /// @param offset      where the first line begins
    /// @param first_line  number of that line, from 1
    explicit LineReader(const InputFile& file, std::uint64_t offset = 0,
                        std::uint64_t first_line = 1);

    /// The next line without its end, valid until the next call.
    /// @return false at the end of the file
    /// @throws InputError if a line is longer than kLongestLine
    bool next(std::string_view& line);

    /// The next line that is not blank.
    bool next_with_text(std::string_view& line);

    /// Number of the line that next() gave last.
    std::uint64_t line_number() const { return line_number_; }

  private:
    /// Moves the rest of the buffer to its front and reads on; false if the file has no more.
    bool refill();

    const InputFile& file_;
    std::vector<char> buffer_;
    std::size_t begin_ = 0;
    std::size_t end_ = 0;
    std::uint64_t offset_;
    std::uint64_t line_number_;
    bool after_return_ = false;  // the last line ended in CR: an LF that follows belongs to it
};

/// True if `line` holds nothing but white space.
bool is_blank(std::string_view line);

}  // namespace knap
