#include "input/ply_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string_view>

#include "base/scalar.hpp"
#include "input/number.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr std::size_t kLongestHeader = std::size_t{1} << 20;

std::optional<ScalarType> scalar_named(std::string_view name) {
    struct Name {
        std::string_view name;
        ScalarType type;
    };
    static constexpr std::array kNames{
        Name{"char", ScalarType::kInt8},      Name{"int8", ScalarType::kInt8},
        Name{"uchar", ScalarType::kUint8},    Name{"uint8", ScalarType::kUint8},
        Name{"short", ScalarType::kInt16},    Name{"int16", ScalarType::kInt16},
        Name{"ushort", ScalarType::kUint16},  Name{"uint16", ScalarType::kUint16},
        Name{"int", ScalarType::kInt32},      Name{"int32", ScalarType::kInt32},
        Name{"uint", ScalarType::kUint32},    Name{"uint32", ScalarType::kUint32},
        Name{"int64", ScalarType::kInt64},    Name{"uint64", ScalarType::kUint64},
        Name{"float", ScalarType::kFloat32},  Name{"float32", ScalarType::kFloat32},
        Name{"double", ScalarType::kFloat64}, Name{"float64", ScalarType::kFloat64},
    };
    for (const Name& known : kNames) {
        if (known.name == name) {
            return known.type;
        }
    }
    return std::nullopt;
}

/// Splits the text of a header into lines and their words.
class HeaderLines {
  public:
    HeaderLines(const InputFile& file, std::string text) : file_(file), text_(std::move(text)) {
        // A data byte after the last line may look like the LF of a CR LF: the first line decides.
        const std::size_t end = text_.find_first_of("\r\n");
        ends_in_return_ = end != std::string::npos && text_[end] == '\r' &&
                          (end + 1 >= text_.size() || text_[end + 1] != '\n');
    }

    /// Words of the next line.
    std::vector<std::string_view> next() {
        const std::size_t end = text_.find(ends_in_return_ ? '\r' : '\n', position_);
        ++line_;
        if (end == std::string::npos) {
            throw InputError(fmt::format(
                "{}: line {}: expected a PLY header that ends in 'end_header', found {}",
                file_.path().string(), line_,
                text_.size() < kLongestHeader ? "the end of the file"
                                              : "more than a header can hold"));
        }
        const std::string_view line = std::string_view(text_).substr(position_, end - position_);
        position_ = end + 1;
        return split(line);
    }

    [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
        throw InputError(fmt::format("{}: line {}: expected {}, found {}", file_.path().string(),
                                     line_, expected, found));
    }

    std::uint64_t line() const { return line_; }
    std::uint64_t offset() const { return position_; }

  private:
    static std::vector<std::string_view> split(std::string_view line) {
        constexpr std::string_view kBlank = " \t\r";
        std::vector<std::string_view> words;
        for (std::size_t begin = line.find_first_not_of(kBlank); begin != std::string_view::npos;) {
            const std::size_t end = std::min(line.find_first_of(kBlank, begin), line.size());
            words.push_back(line.substr(begin, end - begin));
            begin = line.find_first_not_of(kBlank, end);
        }
        return words;
    }

    const InputFile& file_;
    std::string text_;
    bool ends_in_return_ = false;
    std::size_t position_ = 0;
    std::uint64_t line_ = 0;
};

std::string joined(std::span<const std::string_view> words) {
    return excerpt(fmt::format("{}", fmt::join(words, " ")));
}

PlyEncoding parse_format(const HeaderLines& lines, std::span<const std::string_view> words) {
    if (words.size() == 3 && words[2] == "1.0") {
        if (words[1] == "ascii") {
            return PlyEncoding::kAscii;
        }
        if (words[1] == "binary_little_endian") {
            return PlyEncoding::kLittleEndian;
        }
        if (words[1] == "binary_big_endian") {
            return PlyEncoding::kBigEndian;
        }
    }
    lines.fail("'format' with ascii, binary_little_endian or binary_big_endian and 1.0",
               joined(words));
}

PlyElement parse_element(const HeaderLines& lines, std::span<const std::string_view> words) {
    const std::optional<std::uint64_t> count =
        words.size() == 3 ? parse_count(words[2]) : std::nullopt;
    if (!count) {
        lines.fail("'element' with a name and a count", joined(words));
    }
    return PlyElement{.name = std::string(words[1]), .count = *count, .properties = {}};
}

PlyProperty parse_property(const HeaderLines& lines, std::span<const std::string_view> words) {
    PlyProperty property;
    const bool is_list = words.size() > 1 && words[1] == "list";
    if (words.size() != (is_list ? 5 : 3)) {
        lines.fail("'property' with a type and a name", joined(words));
    }
    const std::string_view type_name = words[is_list ? 3 : 1];
    const std::optional<ScalarType> type = scalar_named(type_name);
    if (!type) {
        lines.fail("a PLY type such as float or uchar", excerpt(type_name));
    }
    property.type = *type;
    property.name = words.back();
    if (is_list) {
        property.list_count = scalar_named(words[2]);
        if (!property.list_count || is_floating(*property.list_count)) {
            lines.fail("an integer type for the length of a list", excerpt(words[2]));
        }
    }
    return property;
}

/// Finds the vertex element and its coordinates.
void locate_vertices(PlyHeader& header, const InputFile& file) {
    const auto is_vertex = [](const PlyElement& element) { return element.name == "vertex"; };
    const auto found = std::ranges::find_if(header.elements, is_vertex);
    if (found == header.elements.end() || std::ranges::count_if(header.elements, is_vertex) != 1) {
        throw InputError(
            fmt::format("{}: expected one element 'vertex' in the PLY header, found {}",
                        file.path().string(), found == header.elements.end() ? "none" : "several"));
    }
    header.vertex = static_cast<std::size_t>(found - header.elements.begin());
    constexpr std::array kAxes{"x", "y", "z"};
    for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
        std::size_t matches = 0;
        for (std::size_t i = 0; i < found->properties.size(); ++i) {
            if (found->properties[i].name == kAxes[axis] && !found->properties[i].list_count) {
                header.axes[axis] = i;
                ++matches;
            }
        }
        if (matches != 1) {
            throw InputError(
                fmt::format("{}: expected one property '{}' in the element 'vertex' of the PLY "
                            "header, found {}",
                            file.path().string(), kAxes[axis], matches));
        }
    }
}

}  // namespace

bool PlyElement::fixed_size() const {
    return std::ranges::none_of(properties,
                                [](const PlyProperty& p) { return p.list_count.has_value(); });
}

std::size_t PlyElement::stride() const {
    std::size_t bytes = 0;
    for (const PlyProperty& property : properties) {
        bytes += size_of(property.list_count.value_or(property.type));
    }
    return bytes;
}

PlyHeader read_ply_header(const InputFile& file) {
    std::string text(static_cast<std::size_t>(std::min<std::uint64_t>(file.size(), kLongestHeader)),
                     '\0');
    text.resize(file.read_some(0, std::as_writable_bytes(std::span(text.data(), text.size()))));
    HeaderLines lines(file, std::move(text));
    if (const auto words = lines.next(); words.size() != 1 || words[0] != "ply") {
        lines.fail("'ply'", joined(words));
    }
    PlyHeader header;
    bool has_format = false;
    for (;;) {
        const std::vector<std::string_view> words = lines.next();
        if (words.empty() || words[0] == "comment" || words[0] == "obj_info") {
            continue;
        }
        if (words[0] == "end_header") {
            break;
        }
        if (words[0] == "format") {
            header.encoding = parse_format(lines, words);
            has_format = true;
        } else if (words[0] == "element") {
            header.elements.push_back(parse_element(lines, words));
        } else if (words[0] == "property" && !header.elements.empty()) {
            header.elements.back().properties.push_back(parse_property(lines, words));
        } else {
            lines.fail("a line of a PLY header or 'end_header'", joined(words));
        }
    }
    if (!has_format) {
        lines.fail("a line 'format' before the end of the PLY header", "none");
    }
    header.data_offset = lines.offset();
    header.data_line = lines.line() + 1;
    locate_vertices(header, file);
    return header;
}

}  // namespace knap
