#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/file.hpp"

namespace knap {

/// The fields of one line of a table, one after the other.
class TextFields {
  public:
    static constexpr char kBlanks = ' ';  ///< the separator that means any run of white space

    TextFields(std::string_view line, char separator) : rest_(line), separator_(separator) {}

    /// The next field without blanks and quotes around it.
    /// @return false if there is none
    bool next(std::string_view& field);

  private:
    bool next_separated(std::string_view& field);

    std::string_view rest_;
    char separator_;
    bool ended_ = false;
};

/// Is this line a comment, or blank?
bool is_text_comment(std::string_view line);

/// How a text file holds points: one a line, after some lines that are none.
struct TextLayout {
    char separator = TextFields::kBlanks;      ///< kBlanks, ',' or ';'
    std::array<std::size_t, 3> axes{0, 1, 2};  ///< columns of x, y and z
    std::size_t columns = 3;                   ///< in a line
    std::vector<std::string> names;            ///< of the columns
    std::vector<bool> has_words;               ///< of the columns: some values are no numbers
    std::optional<std::uint64_t> count;        ///< PTS: points by the first line
    std::uint64_t count_line = 0;              ///< PTS: number of that line
    std::uint64_t lines_before = 0;            ///< lines before the first point
};

/// Offset of the first character behind a byte order mark.
std::uint64_t text_begin(const InputFile& file);

/// Reads the first lines.
/// @throws InputError if they are no table with three columns of numbers, or of a kind that knap
///         does not read (landmarks)
TextLayout read_text_layout(const InputFile& file);

/// Would read_text_layout() succeed without taking a line of words on trust? True for a first line
/// of numbers or a header that names x, y and z.
bool looks_like_points(const InputFile& file);

}  // namespace knap
