#include "input/text_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "input/columns.hpp"
#include "input/gzip.hpp"
#include "input/line_reader.hpp"
#include "input/number.hpp"
#include "input/text_layout.hpp"
#include "input/words.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

const char* format_name(const TextLayout& layout) {
    if (layout.count) {
        return "PTS (text)";
    }
    switch (layout.separator) {
        case ',':
            return "text (comma-separated)";
        case ';':
            return "text (semicolon-separated)";
        default:
            return "text (blank-separated)";
    }
}

/// A value that is not there, in a file with other separators than blanks.
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

class TextSource final : public PointSource {
  public:
    TextSource(InputFile file, TextLayout layout)
        : file_(std::move(file)),
          layout_(std::move(layout)),
          lines_(file_, text_begin(file_)),
          needed_(std::ranges::max(layout_.axes) + 1),
          axis_of_(layout_.columns, kNoTarget),
          parsed_(needed_) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            axis_of_[layout_.axes[axis]] = static_cast<int>(axis);
        }
        target_of_ = axis_of_;
        info_.path = file_.path();
        info_.format =
            fmt::format("{}{}", format_name(layout_), is_gunzipped(file_) ? ", gzip" : "");
        describe_columns();
        info_.size_bytes = file_.size_on_disk();
        std::string_view line;
        while (lines_.line_number() < layout_.lines_before && lines_.next(line)) {
        }
    }

    const SourceInfo& info() const override { return info_; }

    void select(std::span<const std::size_t> attributes) override {
        selection_.select(info_, attributes);
        target_of_ = axis_of_;
        for (std::size_t i = 0; i < attributes.size(); ++i) {
            target_of_[place_of_[attributes[i]]] = kFirstColumn + static_cast<int>(i);
        }
        const auto last = std::find_if(target_of_.rbegin(), target_of_.rend(),
                                       [](int target) { return target != kNoTarget; });
        parsed_ = static_cast<std::size_t>(target_of_.rend() - last);
    }

    bool read(Chunk& chunk, std::size_t max_points) override {
        chunk.first = next_;
        chunk.positions.clear();
        selection_.resize(chunk, 0);
        std::string_view line;
        while (chunk.positions.size() < max_points && lines_.next(line)) {
            if (is_text_comment(line)) {
                continue;
            }
            if (layout_.count == next_ + chunk.positions.size() && begins_scan(line)) {
                continue;
            }
            parse(line, chunk);
        }
        next_ += chunk.positions.size();
        if (chunk.positions.empty() && layout_.count.value_or(0) > next_) {
            throw InputError(
                fmt::format("{}: the data ends early: expected {} points as line {} says, found {}",
                            file_.path().string(), *layout_.count, layout_.count_line, next_));
        }
        return !chunk.positions.empty();
    }

    void seek(std::uint64_t index) override {
        throw InputError(fmt::format("{}: cannot seek to point {}: text is read from its start",
                                     file_.path().string(), index));
    }

  private:
    // What a column of the file is parsed for: an axis from 0 on, a column of the chunk from
    // kFirstColumn on, or nothing.
    static constexpr int kNoTarget = -1;
    static constexpr int kFirstColumn = 3;

    void describe_columns() {
        for (std::size_t i = 0; i < layout_.columns; ++i) {
            if (layout_.has_words[i]) {
                info_.unsupported.push_back(fmt::format("words in column '{}'", layout_.names[i]));
                continue;
            }
            if (axis_of_[i] != kNoTarget) {
                info_.axes[static_cast<std::size_t>(axis_of_[i])] = info_.schema.size();
            }
            info_.schema.push_back({layout_.names[i], ScalarType::kFloat64, 1});
            place_of_.push_back(i);
        }
        make_names_unique(info_.schema);
    }

    /// Behind as many points as the file tells of: is this the count of another scan? If not, there
    /// are more points than it tells of, and they are read.
    bool begins_scan(std::string_view line) {
        const std::optional<std::uint64_t> more = parse_count(trimmed(line));
        if (more) {
            layout_.count = *layout_.count + *more;
            layout_.count_line = lines_.line_number();
        }
        return more.has_value();
    }

    /// Appends the point of a line to the chunk.
    void parse(std::string_view line, Chunk& chunk) const {
        Vec3 position;
        TextFields fields(line, layout_.separator);
        std::string_view field;
        std::size_t column = 0;
        for (; column < parsed_ && fields.next(field); ++column) {
            const int target = target_of_[column];
            if (target == kNoTarget) {
                continue;
            }
            std::optional<double> value = parse_double(field);
            if (field.empty() && target >= kFirstColumn) {
                value = kMissing;
            }
            if (!value) {
                fail(fmt::format("a number in column {}", column + 1), excerpt(field));
            }
            if (target < kFirstColumn) {
                position[target] = *value;
            } else {
                append(*value, target, chunk);
            }
        }
        // Between blanks a missing value would shift the others: there the number of columns tells.
        const bool strict = layout_.separator == TextFields::kBlanks;
        const std::size_t parsed = column;
        while (strict && fields.next(field)) {
            ++column;
        }
        if (column < needed_ || (strict && column != layout_.columns)) {
            fail(fmt::format("{} columns", layout_.columns), fmt::format("{}", column));
        }
        for (std::size_t missing = parsed; missing < parsed_; ++missing) {
            if (target_of_[missing] != kNoTarget) {
                append(kMissing, target_of_[missing], chunk);
            }
        }
        chunk.positions.push_back(position);
    }

    static void append(double value, int target, Chunk& chunk) {
        const auto bytes = std::bit_cast<std::array<std::byte, sizeof value>>(value);
        std::vector<std::byte>& column =
            chunk.columns[static_cast<std::size_t>(target - kFirstColumn)];
        column.insert(column.end(), bytes.begin(), bytes.end());
    }

    [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
        throw InputError(fmt::format("{}: line {}: expected {}, found {}", file_.path().string(),
                                     lines_.line_number(), expected, found));
    }

    InputFile file_;
    TextLayout layout_;
    LineReader lines_;
    std::size_t needed_;                 // columns up to the last coordinate
    std::vector<int> axis_of_;           // targets of the columns when none are selected
    std::vector<int> target_of_;         // targets of the columns
    std::size_t parsed_;                 // columns up to the last one with a target
    std::vector<std::size_t> place_of_;  // column of each attribute of the schema
    SourceInfo info_;
    ColumnSelection selection_;
    std::uint64_t next_ = 0;
};

}  // namespace

std::unique_ptr<PointSource> open_text(InputFile file) {
    TextLayout layout = read_text_layout(file);
    return std::make_unique<TextSource>(std::move(file), std::move(layout));
}

}  // namespace knap
