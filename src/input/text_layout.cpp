#include "input/text_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>

#include "input/line_reader.hpp"
#include "input/number.hpp"
#include "input/words.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

std::string lower(std::string_view text) {
    std::string result(text);
    std::ranges::transform(result, result.begin(), [](char c) {
        return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    return result;
}

char separator_of(std::string_view line) {
    for (const char separator : {';', ','}) {
        if (line.find(separator) != std::string_view::npos) {
            return separator;
        }
    }
    return TextFields::kBlanks;
}

std::vector<std::string> fields_of(std::string_view line) {
    TextFields fields(line, separator_of(line));
    std::vector<std::string> all;
    for (std::string_view field; fields.next(field);) {
        all.emplace_back(field);
    }
    return all;
}

/// Is this meant as a number? "1,5" is, though it is none: its line is no header.
bool looks_numeric(std::string_view field) {
    const std::size_t digit = field.find_first_not_of("+-.");
    return parse_double(field) || (digit <= 2 && field[digit] >= '0' && field[digit] <= '9');
}

bool has_number(std::span<const std::string> fields) {
    return std::ranges::any_of(fields, looks_numeric);
}

/// Works out the layout line by line.
class Detector {
  public:
    explicit Detector(const InputFile& file) : file_(file), lines_(file, text_begin(file)) {}

    TextLayout detect();
    bool looks_certain();

  private:
    bool next(std::string_view& line);
    void take_count(const std::string& field);
    void take_header(const std::vector<std::string>& header);
    void take_first_point(std::string_view line, const std::vector<std::string>& header);
    void take_comment_header();
    void find_words(std::string_view line);
    void name_columns();
    [[noreturn]] void fail(std::string_view expected, std::string_view found) const;

    const InputFile& file_;
    LineReader lines_;
    TextLayout layout_;
    std::string comment_;  // the last one before the points
    std::uint64_t header_line_ = 0;
    bool header_names_axes_ = false;
};

void Detector::fail(std::string_view expected, std::string_view found) const {
    throw InputError(fmt::format("{}: line {}: expected {}, found {}", file_.path().string(),
                                 lines_.line_number(), expected, found));
}

/// The next line that is no comment.
bool Detector::next(std::string_view& line) {
    while (lines_.next(line)) {
        if (!is_text_comment(line)) {
            return true;
        }
        if (layout_.has_words.empty() && !is_blank(line)) {
            comment_ = line;
        }
    }
    return false;
}

void Detector::take_count(const std::string& field) {
    layout_.count = parse_count(field);
    if (!layout_.count) {
        fail("at least 3 columns of numbers, or a number of points", excerpt(field));
    }
    layout_.count_line = lines_.line_number();
}

/// Finds the columns by name. A header without any of x, y and z is a title, unless it has a name
/// for each column: then the first three columns would be a guess.
void Detector::take_header(const std::vector<std::string>& header) {
    header_line_ = lines_.line_number();
    layout_.names = header;
    constexpr std::array<std::string_view, 3> kAxes{"x", "y", "z"};
    std::array<std::ptrdiff_t, 3> matches{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < header.size(); ++i) {
            if (lower(header[i]) == kAxes[axis]) {
                layout_.axes[axis] = i;
                ++matches[axis];
            }
        }
    }
    header_names_axes_ = matches == std::array<std::ptrdiff_t, 3>{1, 1, 1};
    if (!header_names_axes_ && matches != std::array<std::ptrdiff_t, 3>{}) {
        fail("one column each named x, y and z",
             excerpt(fmt::format("{}", fmt::join(header, ","))));
    }
}

void Detector::take_first_point(std::string_view line, const std::vector<std::string>& header) {
    layout_.separator = separator_of(line);
    layout_.columns = fields_of(line).size();
    layout_.lines_before = lines_.line_number() - 1;
    if (!header.empty() && !header_names_axes_) {
        if (header.size() == layout_.columns) {
            throw InputError(fmt::format("{}: line {}: expected columns named x, y and z, found {}",
                                         file_.path().string(), header_line_,
                                         excerpt(fmt::format("{}", fmt::join(header, ",")))));
        }
        layout_.names.clear();
    }
    if (header.empty()) {
        take_comment_header();
    }
    const std::size_t needed = std::ranges::max(layout_.axes) + 1;
    if (layout_.columns < needed) {
        fail(fmt::format("at least {} columns", needed), fmt::format("{}", layout_.columns));
    }
}

/// Some programs write names as a comment: //X Y Z R G B. They are taken where there is one for
/// each column, and x, y and z are among them.
void Detector::take_comment_header() {
    const std::size_t begin = comment_.find_first_not_of(" \t#/");
    if (begin == std::string::npos) {
        return;
    }
    const std::vector<std::string> names = fields_of(std::string_view(comment_).substr(begin));
    std::array<std::size_t, 3> axes{};
    for (std::size_t axis = 0; axis < axes.size(); ++axis) {
        constexpr std::array<std::string_view, 3> kAxes{"x", "y", "z"};
        const auto is_axis = [&](const std::string& name) { return lower(name) == kAxes[axis]; };
        if (std::ranges::count_if(names, is_axis) != 1) {
            return;
        }
        axes[axis] = static_cast<std::size_t>(std::ranges::find_if(names, is_axis) - names.begin());
    }
    if (names.size() == layout_.columns) {
        layout_.names = names;
        layout_.axes = axes;
    }
}

/// Looks at the first lines for columns that hold words.
void Detector::find_words(std::string_view line) {
    constexpr int kLines = 1000;
    layout_.has_words.resize(layout_.columns);
    for (int i = 0; i < kLines; ++i) {
        TextFields fields(line, layout_.separator);
        std::string_view field;
        for (std::size_t column = 0; column < layout_.columns && fields.next(field); ++column) {
            const bool is_axis = std::ranges::find(layout_.axes, column) != layout_.axes.end();
            layout_.has_words[column] =
                layout_.has_words[column] || (!is_axis && !field.empty() && !parse_double(field));
        }
        if (!next(line)) {
            return;
        }
    }
}

void Detector::name_columns() {
    constexpr std::array kNames{"x", "y", "z", "intensity", "red", "green", "blue"};
    const bool is_pts = layout_.count.has_value() && layout_.columns <= kNames.size();
    const std::size_t known = is_pts && layout_.columns != 6 ? kNames.size() : 3;
    for (std::size_t i = layout_.names.size(); i < layout_.columns; ++i) {
        layout_.names.push_back(i < known ? kNames[i] : fmt::format("column{}", i + 1));
    }
    layout_.names.resize(layout_.columns);
    for (std::size_t i = 0; i < layout_.columns; ++i) {
        if (layout_.names[i].empty()) {
            layout_.names[i] = fmt::format("column{}", i + 1);
        }
    }
    layout_.has_words.resize(layout_.columns);
}

TextLayout Detector::detect() {
    std::string_view line;
    if (!next(line)) {
        throw InputError(fmt::format("{}: expected lines of numbers, found {}",
                                     file_.path().string(),
                                     lines_.line_number() == 0 ? "none" : "only comments"));
    }
    if (lower(line).starts_with("version:")) {
        fail("a point cloud", "a landmark file (version, n_points), which knap does not read");
    }
    std::vector<std::string> fields = fields_of(line);
    std::vector<std::string> header;
    bool has_line = true;
    if (!has_number(fields)) {
        header = fields;
        layout_.separator = separator_of(line);
        take_header(header);
        has_line = next(line);
    } else if (fields.size() == 1) {
        take_count(fields[0]);
        has_line = next(line);
        if (has_line && fields_of(line).size() == 1 && parse_count(trimmed(line))) {
            fail("a point", "a second count, as in a PTX file, without the rest of its header");
        }
    }
    if (has_line) {
        take_first_point(line, header);
        find_words(line);
    } else if (header_names_axes_ || layout_.count == 0) {
        layout_.columns = std::max<std::size_t>(header.size(), 3);
        layout_.lines_before = lines_.line_number();
    } else {
        fail("lines of numbers", "the end of the file");
    }
    name_columns();
    return std::move(layout_);
}

bool Detector::looks_certain() {
    std::string_view line;
    if (!next(line)) {
        return false;
    }
    std::vector<std::string> fields = fields_of(line);
    if (!has_number(fields)) {
        take_header(fields);
        return header_names_axes_;
    }
    if (fields.size() == 1 && parse_count(fields[0]) && next(line)) {
        fields = fields_of(line);
    }
    return fields.size() >= 3 && std::ranges::all_of(std::span(fields).first(3), looks_numeric);
}

}  // namespace

bool TextFields::next(std::string_view& field) {
    if (separator_ != kBlanks) {
        return next_separated(field);
    }
    field = take_word(rest_);
    if (field.empty() || field[0] == '#' || field.starts_with("//")) {
        return false;
    }
    if (field.size() > 1 && field.front() == '"' && field.back() == '"') {
        field = field.substr(1, field.size() - 2);
    }
    return true;
}

bool TextFields::next_separated(std::string_view& field) {
    if (ended_) {
        return false;
    }
    std::size_t search = 0;
    if (const std::size_t first = rest_.find_first_not_of(" \t");
        first != std::string_view::npos && rest_[first] == '"') {
        const std::size_t closing = rest_.find('"', first + 1);
        search = closing == std::string_view::npos ? 0 : closing;
    }
    const std::size_t end = rest_.find(separator_, search);
    field = trimmed(rest_.substr(0, end));
    if (field.size() > 1 && field.front() == '"' && field.back() == '"') {
        field = trimmed(field.substr(1, field.size() - 2));
    }
    ended_ = end == std::string_view::npos;
    rest_.remove_prefix(ended_ ? rest_.size() : end + 1);
    return true;
}

bool is_text_comment(std::string_view line) {
    const std::size_t first = line.find_first_not_of(" \t\f\v");
    return first == std::string_view::npos || line[first] == '#' ||
           line.substr(first).starts_with("//");
}

std::uint64_t text_begin(const InputFile& file) {
    constexpr std::array kMark{std::byte{0xef}, std::byte{0xbb}, std::byte{0xbf}};
    std::array<std::byte, 3> head{};
    file.read_some(0, head);
    return head == kMark ? head.size() : 0;
}

TextLayout read_text_layout(const InputFile& file) {
    return Detector(file).detect();
}

bool looks_like_points(const InputFile& file) {
    try {
        return Detector(file).looks_certain();
    } catch (const InputError&) {
        return false;
    }
}

}  // namespace knap
