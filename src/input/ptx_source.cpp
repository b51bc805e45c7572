#include "input/ptx_source.hpp"

#include <fmt/format.h>

#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "input/columns.hpp"
#include "input/gzip.hpp"
#include "input/line_reader.hpp"
#include "input/number.hpp"
#include "input/text_layout.hpp"
#include "input/words.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr std::size_t kWithoutColours = 4;
constexpr std::size_t kWithColours = 7;
constexpr std::uint64_t kMostCells = std::uint64_t{1} << 40;
constexpr double kNoReturn = std::numeric_limits<double>::quiet_NaN();

/// A point times it: as a row of four before it, so that the last row moves.
using Matrix = std::array<std::array<double, 4>, 4>;

Vec3 moved(const Vec3& p, const Matrix& m) {
    Vec3 result;
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<std::size_t>(axis);
        result[axis] = p.x * m[0][i] + p.y * m[1][i] + p.z * m[2][i] + m[3][i];
    }
    return result;
}

std::vector<std::string_view> words_of(std::string_view line) {
    std::vector<std::string_view> words;
    words.reserve(kWithColours + 1);
    for (std::string_view word = take_word(line); !word.empty() && words.size() <= kWithColours;
         word = take_word(line)) {
        words.push_back(word);
    }
    return words;
}

class PtxSource final : public PointSource {
  public:
    explicit PtxSource(InputFile file) : file_(std::move(file)), lines_(file_, text_begin(file_)) {
        std::string_view line;
        if (!lines_.next_with_text(line)) {
            fail("a number of columns", "the end of the file");
        }
        begin_scan(line);
        describe();
    }

    const SourceInfo& info() const override { return info_; }

    void select(std::span<const std::size_t> attributes) override {
        selection_.select(info_, attributes);
    }

    bool read(Chunk& chunk, std::size_t max_points) override {
        chunk.first = next_;
        chunk.positions.clear();
        selection_.resize(chunk, 0);
        std::string_view line;
        while (chunk.positions.size() < max_points && next_cell(line)) {
            parse(line, chunk);
        }
        next_ += chunk.positions.size();
        return !chunk.positions.empty();
    }

    void seek(std::uint64_t index) override {
        throw InputError(fmt::format("{}: cannot seek to point {}: text is read from its start",
                                     file_.path().string(), index));
    }

  private:
    /// The line of the next cell; false at the end of the last scan.
    bool next_cell(std::string_view& line) {
        if (ahead_) {
            line = *std::exchange(ahead_, std::nullopt);
            --left_;
            return true;
        }
        bool more = lines_.next_with_text(line);
        while (left_ == 0) {  // scans may be empty
            if (!more) {
                return false;
            }
            begin_scan(line);
            more = lines_.next_with_text(line);
        }
        if (!more) {
            throw InputError(fmt::format(
                "{}: the data ends early: expected {} cells in the scan of line {}, found {}",
                file_.path().string(), cells_, scan_line_, cells_ - left_));
        }
        --left_;
        return true;
    }

    /// Reads a header, of which the first line is there.
    void begin_scan(std::string_view first) {
        scan_line_ = lines_.line_number();
        const std::uint64_t columns = count_in(first, "columns");
        const std::uint64_t rows = count_in(next_of_header(), "rows");
        if (rows != 0 && columns > kMostCells / rows) {
            fail(fmt::format("at most {} cells", kMostCells),
                 fmt::format("{} x {}", columns, rows));
        }
        cells_ = left_ = columns * rows;
        for (int i = 0; i < 4; ++i) {  // where the scanner stood, and its axes
            numbers_in<3>(next_of_header());
        }
        for (std::array<double, 4>& row : matrix_) {
            row = numbers_in<4>(next_of_header());
            const double expected = &row == &matrix_.back() ? 1 : 0;
            if (row[3] != expected) {
                fail(fmt::format("{} as the fourth number of a line of the matrix", expected),
                     fmt::to_string(row[3]));
            }
        }
    }

    std::string_view next_of_header() {
        std::string_view line;
        if (!lines_.next_with_text(line)) {
            fail("a header of ten lines", "the end of the file");
        }
        return line;
    }

    std::uint64_t count_in(std::string_view line, std::string_view what) const {
        const std::optional<std::uint64_t> count = parse_count(trimmed(line));
        if (!count) {
            fail(fmt::format("a number of {}", what), excerpt(line));
        }
        return *count;
    }

    template <std::size_t N>
    std::array<double, N> numbers_in(std::string_view line) const {
        const std::vector<std::string_view> words = words_of(line);
        std::array<double, N> numbers{};
        if (words.size() != N) {
            fail(fmt::format("{} numbers", N), excerpt(line));
        }
        for (std::size_t i = 0; i < N; ++i) {
            numbers[i] = number_in(words[i], i);
        }
        return numbers;
    }

    double number_in(std::string_view word, std::size_t column) const {
        const std::optional<double> value = parse_double(word);
        if (!value) {
            fail(fmt::format("a number in column {}", column + 1), excerpt(word));
        }
        return *value;
    }

    /// The first cell tells whether there are colours.
    void describe() {
        std::string_view line;
        std::size_t columns = kWithoutColours;
        while (left_ == 0 && lines_.next_with_text(line)) {
            begin_scan(line);
        }
        if (left_ > 0) {
            if (!lines_.next_with_text(line)) {
                fail("the first cell", "the end of the file");
            }
            ahead_ = line;
            columns = words_of(line).size();
            if (columns != kWithColours && columns != kWithoutColours) {
                fail("4 or 7 columns", fmt::to_string(columns));
            }
        }
        columns_ = columns;
        info_.path = file_.path();
        info_.format = is_gunzipped(file_) ? "PTX (text), gzip" : "PTX (text)";
        for (const char* name : {"x", "y", "z", "intensity"}) {
            info_.schema.push_back({name, ScalarType::kFloat64, 1});
        }
        if (columns == kWithColours) {
            for (const char* name : {"red", "green", "blue"}) {
                info_.schema.push_back({name, ScalarType::kUint8, 1});
            }
        }
        info_.size_bytes = file_.size_on_disk();
        info_.unsupported.emplace_back("places and axes of scanners, and the grid of their cells");
    }

    void parse(std::string_view line, Chunk& chunk) const {
        const std::vector<std::string_view> words = words_of(line);
        if (words.size() != columns_) {
            fail(fmt::format("{} columns as in the first cell", columns_),
                 fmt::to_string(words.size()));
        }
        const Vec3 p{number_in(words[0], 0), number_in(words[1], 1), number_in(words[2], 2)};
        const bool returned = p.x != 0 || p.y != 0 || p.z != 0;
        chunk.positions.push_back(returned ? moved(p, matrix_)
                                           : Vec3{kNoReturn, kNoReturn, kNoReturn});
        for (std::size_t i = 0; i < selection_.size(); ++i) {
            const std::size_t column = selection_.attribute(i);
            const ScalarType type = info_.schema[column].type;
            std::vector<std::byte>& values = chunk.columns[i];
            values.resize(values.size() + selection_.value_size(i));
            if (!parse_value(words[column], type,
                             values.data() + values.size() - selection_.value_size(i))) {
                fail(fmt::format("a value of {} in column {}", to_string(type), column + 1),
                     excerpt(words[column]));
            }
        }
    }

    [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
        throw InputError(fmt::format("{}: line {}: expected {}, found {}", file_.path().string(),
                                     lines_.line_number(), expected, found));
    }

    InputFile file_;
    LineReader lines_;
    std::uint64_t scan_line_ = 0;  // the first one of its header
    std::uint64_t cells_ = 0;      // of the scan
    std::uint64_t left_ = 0;       // of them, not read yet
    Matrix matrix_{};
    std::size_t columns_ = kWithoutColours;
    std::optional<std::string_view>
        ahead_;  // a line that was looked at, and is in the reader still
    SourceInfo info_;
    ColumnSelection selection_;
    std::uint64_t next_ = 0;
};

}  // namespace

std::unique_ptr<PointSource> open_ptx(InputFile file) {
    return std::make_unique<PtxSource>(std::move(file));
}

bool looks_like_ptx(const InputFile& file) {
    constexpr std::array<std::size_t, 10> kWords{1, 1, 3, 3, 3, 3, 4, 4, 4, 4};
    LineReader lines(file, text_begin(file));
    for (const std::size_t expected : kWords) {
        std::string_view line;
        if (!lines.next_with_text(line)) {
            return false;
        }
        const std::vector<std::string_view> words = words_of(line);
        if (words.size() != expected) {
            return false;
        }
        for (const std::string_view word : words) {
            if (expected == 1 ? !parse_count(word).has_value() : !parse_double(word).has_value()) {
                return false;
            }
        }
    }
    return true;
}

}  // namespace knap
