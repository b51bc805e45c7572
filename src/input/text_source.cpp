#include "input/text_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "input/line_reader.hpp"
#include "input/number.hpp"
#include "input/text_layout.hpp"
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

class TextSource final : public PointSource {
  public:
    TextSource(InputFile file, TextLayout layout)
        : file_(std::move(file)),
          layout_(std::move(layout)),
          lines_(file_, text_begin(file_)),
          needed_(std::ranges::max(layout_.axes) + 1),
          axis_of_(needed_, -1) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            axis_of_[layout_.axes[axis]] = static_cast<int>(axis);
        }
        info_.path = file_.path();
        info_.format = format_name(layout_);
        for (const std::string& name : layout_.names) {
            info_.schema.push_back({name, ScalarType::kFloat64, 1});
        }
        info_.declared_count = layout_.count;
        info_.size_bytes = file_.size();
        std::string_view line;
        while (lines_.line_number() < layout_.lines_before && lines_.next(line)) {
        }
    }

    const SourceInfo& info() const override { return info_; }

    void select(std::span<const std::size_t> attributes) override {
        if (!attributes.empty()) {
            throw InputError(
                fmt::format("{}: expected a binary PLY to read attributes of, found text",
                            file_.path().string()));
        }
    }

    bool read(Chunk& chunk, std::size_t max_points) override {
        chunk.first = next_;
        chunk.positions.clear();
        std::string_view line;
        while (chunk.positions.size() < max_points && lines_.next(line)) {
            if (is_text_comment(line)) {
                continue;
            }
            if (layout_.count == next_ + chunk.positions.size()) {
                fail(fmt::format("the end after {} points as line {} says", *layout_.count,
                                 layout_.count_line),
                     excerpt(line));
            }
            chunk.positions.push_back(parse(line));
        }
        next_ += chunk.positions.size();
        if (chunk.positions.empty() && layout_.count.value_or(next_) != next_) {
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
    Vec3 parse(std::string_view line) const {
        Vec3 position;
        TextFields fields(line, layout_.separator);
        std::string_view field;
        std::size_t column = 0;
        for (; column < needed_ && fields.next(field); ++column) {
            if (axis_of_[column] < 0) {
                continue;
            }
            const std::optional<double> value = parse_double(field);
            if (!value) {
                fail(fmt::format("a number in column {}", column + 1), excerpt(field));
            }
            position[axis_of_[column]] = *value;
        }
        // Between blanks a missing value would shift the others: there the number of columns tells.
        const bool strict = layout_.separator == TextFields::kBlanks;
        while (strict && fields.next(field)) {
            ++column;
        }
        if (column < needed_ || (strict && column != layout_.columns)) {
            fail(fmt::format("{} columns", layout_.columns), fmt::format("{}", column));
        }
        return position;
    }

    [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
        throw InputError(fmt::format("{}: line {}: expected {}, found {}", file_.path().string(),
                                     lines_.line_number(), expected, found));
    }

    InputFile file_;
    TextLayout layout_;
    LineReader lines_;
    std::size_t needed_;        // columns up to the last coordinate
    std::vector<int> axis_of_;  // for each of them: 0, 1, 2 or -1
    SourceInfo info_;
    std::uint64_t next_ = 0;
};

}  // namespace

std::unique_ptr<PointSource> open_text(InputFile file) {
    TextLayout layout = read_text_layout(file);
    return std::make_unique<TextSource>(std::move(file), std::move(layout));
}

}  // namespace knap
