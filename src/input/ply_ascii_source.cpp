#include "input/ply_ascii_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "input/columns.hpp"
#include "input/line_reader.hpp"
#include "input/number.hpp"
#include "input/words.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

class AsciiPlySource final : public PointSource {
  public:
    AsciiPlySource(InputFile file, PlyHeader header, SourceInfo info)
        : file_(std::move(file)),
          header_(std::move(header)),
          info_(std::move(info)),
          lines_(file_, header_.data_offset, header_.data_line),
          axis_of_(header_.vertices().properties.size(), -1),
          column_of_(axis_of_.size(), -1) {
        check_size();
        for (std::size_t axis = 0; axis < 3; ++axis) {
            axis_of_[header_.axes[axis]] = static_cast<int>(axis);
        }
    }

    const SourceInfo& info() const override { return info_; }

    void select(std::span<const std::size_t> attributes) override;
    bool read(Chunk& chunk, std::size_t max_points) override;
    void seek(std::uint64_t index) override;

  private:
    void check_size() const;
    std::string_view line_of(const PlyElement& element, std::uint64_t instance);
    void skip_element(const PlyElement& element);
    void skip_list(const PlyProperty& property, std::string_view& line);
    void parse_vertex(std::string_view line, Chunk& chunk, std::size_t point);
    void finish();
    [[noreturn]] void fail(std::string_view expected, std::string_view found) const;

    InputFile file_;
    PlyHeader header_;
    SourceInfo info_;
    LineReader lines_;
    std::vector<int> axis_of_;    // for each property of the vertex: 0, 1, 2 or -1
    std::vector<int> column_of_;  // for each property of the vertex: its column in a chunk, or -1
    ColumnSelection selection_;
    std::uint64_t next_ = 0;
    bool started_ = false;
    bool finished_ = false;
};

void AsciiPlySource::fail(std::string_view expected, std::string_view found) const {
    throw InputError(fmt::format("{}: line {}: expected {}, found {}", file_.path().string(),
                                 lines_.line_number(), expected, found));
}

void AsciiPlySource::check_size() const {
    // A value and what parts it from the next take two bytes; the last line may lack its end.
    const std::uint64_t left = file_.size() - header_.data_offset;
    const std::uint64_t most = (left + 1) / (2 * header_.vertices().properties.size());
    if (header_.vertices().count > most) {
        throw InputError(fmt::format(
            "{}: the data ends early: expected {} vertices, found {} bytes, room for at most {}",
            file_.path().string(), header_.vertices().count, left, most));
    }
}

std::string_view AsciiPlySource::line_of(const PlyElement& element, std::uint64_t instance) {
    std::string_view line;
    if (!lines_.next_with_text(line)) {
        throw InputError(fmt::format(
            "{}: the data ends early: expected {} of element '{}', found {} at the end of the "
            "file, line {}",
            file_.path().string(), element.count, element.name, instance, lines_.line_number()));
    }
    return line;
}

void AsciiPlySource::skip_element(const PlyElement& element) {
    if (element.properties.empty()) {
        return;
    }
    for (std::uint64_t i = 0; i < element.count; ++i) {
        line_of(element, i);
    }
}

void AsciiPlySource::skip_list(const PlyProperty& property, std::string_view& line) {
    const std::string_view word = take_word(line);
    const std::optional<std::uint64_t> length = parse_count(word);
    if (!length) {
        fail(fmt::format("the length of the list '{}'", property.name), excerpt(word));
    }
    for (std::uint64_t i = 0; i < *length; ++i) {
        if (take_word(line).empty()) {
            fail(fmt::format("{} values in the list '{}'", *length, property.name),
                 fmt::format("{}", i));
        }
    }
}

void AsciiPlySource::select(std::span<const std::size_t> attributes) {
    selection_.select(info_, attributes);
    const std::vector<PlyProperty>& properties = header_.vertices().properties;
    std::size_t attribute = 0;
    for (std::size_t i = 0; i < properties.size(); ++i) {
        column_of_[i] = -1;
        if (!properties[i].list_count) {
            const auto found = std::ranges::find(attributes, attribute++);
            if (found != attributes.end()) {
                column_of_[i] = static_cast<int>(found - attributes.begin());
            }
        }
    }
}

void AsciiPlySource::parse_vertex(std::string_view line, Chunk& chunk, std::size_t point) {
    const std::vector<PlyProperty>& properties = header_.vertices().properties;
    Vec3& position = chunk.positions[point];
    for (std::size_t i = 0; i < properties.size(); ++i) {
        if (properties[i].list_count) {
            skip_list(properties[i], line);
            continue;
        }
        const std::string_view word = take_word(line);
        if (word.empty()) {
            fail(fmt::format("{} values for a vertex", properties.size()), fmt::format("{}", i));
        }
        bool valid = true;
        if (axis_of_[i] >= 0) {
            const std::optional<double> value = parse_scalar(word, properties[i].type);
            valid = value.has_value();
            position[axis_of_[i]] = value.value_or(0);
        } else if (column_of_[i] >= 0) {
            const auto column = static_cast<std::size_t>(column_of_[i]);
            valid = parse_value(word, properties[i].type, selection_.at(chunk, column, point));
        }
        if (!valid) {
            fail(fmt::format("a value of type {} for '{}'", to_string(properties[i].type),
                             properties[i].name),
                 excerpt(word));
        }
    }
    if (const std::string_view extra = take_word(line); !extra.empty()) {
        fail(fmt::format("{} values for a vertex", properties.size()),
             fmt::format("{} after them", excerpt(extra)));
    }
}

void AsciiPlySource::finish() {
    for (std::size_t i = header_.vertex + 1; i < header_.elements.size(); ++i) {
        skip_element(header_.elements[i]);
    }
    std::string_view line;
    if (lines_.next_with_text(line)) {
        fail("the end of the file after the last element", excerpt(line));
    }
    finished_ = true;
}

bool AsciiPlySource::read(Chunk& chunk, std::size_t max_points) {
    if (!started_) {
        for (std::size_t i = 0; i < header_.vertex; ++i) {
            skip_element(header_.elements[i]);
        }
        started_ = true;
    }
    const PlyElement& vertices = header_.vertices();
    const std::uint64_t left = vertices.count - next_;
    chunk.first = next_;
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(left, max_points));
    chunk.positions.resize(wanted);
    selection_.resize(chunk, wanted);
    if (left == 0) {
        if (!finished_) {
            finish();
        }
        return false;
    }
    for (std::size_t i = 0; i < wanted; ++i) {
        parse_vertex(line_of(vertices, next_ + i), chunk, i);
    }
    next_ += wanted;
    return true;
}

void AsciiPlySource::seek(std::uint64_t index) {
    throw InputError(fmt::format("{}: cannot seek to point {}: an ASCII PLY is read from its start",
                                 file_.path().string(), index));
}

}  // namespace

std::unique_ptr<PointSource> open_ascii_ply(InputFile file, PlyHeader header, SourceInfo info) {
    return std::make_unique<AsciiPlySource>(std::move(file), std::move(header), std::move(info));
}

}  // namespace knap
