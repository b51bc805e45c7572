#include "input/pcd_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <span>
#include <string_view>

#include "input/number.hpp"
#include "input/words.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr std::size_t kLongestHeader = std::size_t{1} << 16;
constexpr std::size_t kLongestPoint = std::size_t{1} << 20;  // bytes

using Words = std::vector<std::string_view>;

/// Type letter and size of a value.
std::optional<ScalarType> scalar_of(std::string_view letter, std::string_view size) {
    struct Name {
        std::string_view letter;
        std::string_view size;
        ScalarType type;
    };
    using enum ScalarType;
    static constexpr std::array kNames{
        Name{"I", "1", kInt8},    Name{"I", "2", kInt16},  Name{"I", "4", kInt32},
        Name{"I", "8", kInt64},   Name{"U", "1", kUint8},  Name{"U", "2", kUint16},
        Name{"U", "4", kUint32},  Name{"U", "8", kUint64}, Name{"F", "4", kFloat32},
        Name{"F", "8", kFloat64},
    };
    for (const Name& known : kNames) {
        if (known.letter == letter && known.size == size) {
            return known.type;
        }
    }
    return std::nullopt;
}

/// Reads the header line by line.
class HeaderReader {
  public:
    explicit HeaderReader(const InputFile& file) : file_(file), text_(kLongestHeader, '\0') {
        text_.resize(file.read_some(0, std::as_writable_bytes(std::span(text_))));
    }

    PcdHeader read();

  private:
    /// The words of the next line; the line itself is what errors name.
    Words next();
    void take(const Words& words);
    void take_data(const Words& words);
    std::uint64_t count_in(const Words& words) const;
    void make_fields();
    void check_points();
    [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
        throw InputError(fmt::format("{}: line {}: expected {}, found {}", file_.path().string(),
                                     line_, expected, found));
    }

    const InputFile& file_;
    std::string text_;
    std::size_t position_ = 0;
    std::uint64_t line_ = 0;
    PcdHeader header_;
    std::vector<std::string> names_;
    std::vector<std::string> sizes_;
    std::vector<std::string> types_;
    std::vector<std::string> counts_;
    std::optional<std::uint64_t> width_;
    std::optional<std::uint64_t> points_;
};

Words HeaderReader::next() {
    ++line_;
    const std::size_t end = text_.find('\n', position_);
    if (end == std::string::npos) {
        fail("a PCD header that ends in a line 'DATA'",
             text_.size() < kLongestHeader ? "the end of the file" : "more than a header can hold");
    }
    std::string_view line = std::string_view(text_).substr(position_, end - position_);
    position_ = end + 1;
    if (line.ends_with('\r')) {
        line.remove_suffix(1);
    }
    Words words;
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
        words.push_back(word);
    }
    return words;
}

std::uint64_t HeaderReader::count_in(const Words& words) const {
    const std::optional<std::uint64_t> count =
        words.size() == 2 ? parse_count(words[1]) : std::nullopt;
    if (!count) {
        fail(fmt::format("'{}' and a number", words[0]),
             excerpt(fmt::format("{}", fmt::join(words, " "))));
    }
    return *count;
}

void HeaderReader::take_data(const Words& words) {
    const std::string_view kind = words.size() == 2 ? words[1] : std::string_view();
    if (kind == "ascii") {
        header_.encoding = PcdEncoding::kAscii;
    } else if (kind == "binary") {
        header_.encoding = PcdEncoding::kBinary;
    } else if (kind == "binary_compressed") {
        header_.encoding = PcdEncoding::kCompressed;
    } else {
        fail("'DATA' with ascii, binary or binary_compressed",
             excerpt(fmt::format("{}", fmt::join(words, " "))));
    }
}

void HeaderReader::take(const Words& words) {
    const auto values = [&] { return std::vector<std::string>(words.begin() + 1, words.end()); };
    const std::string_view key = words[0];
    if (key == "FIELDS" || key == "COLUMNS") {
        names_ = values();
    } else if (key == "SIZE") {
        sizes_ = values();
    } else if (key == "TYPE") {
        types_ = values();
    } else if (key == "COUNT") {
        counts_ = values();
    } else if (key == "WIDTH") {
        width_ = count_in(words);
    } else if (key == "HEIGHT") {
        header_.height = count_in(words);
    } else if (key == "POINTS") {
        points_ = count_in(words);
    } else if (key == "VIEWPOINT") {
        constexpr std::array kOrigin{"0", "0", "0", "1", "0", "0", "0"};
        header_.has_viewpoint = !std::ranges::equal(values(), kOrigin);
    } else if (key != "VERSION") {
        fail("a line of a PCD header", excerpt(fmt::format("{}", fmt::join(words, " "))));
    }
}

void HeaderReader::make_fields() {
    if (names_.empty()) {
        fail("a line 'FIELDS' before the data", "none");
    }
    const auto expect_one_each = [&](const char* key, const std::vector<std::string>& values) {
        if (values.size() != names_.size()) {
            fail(fmt::format("a {} for each of {} fields", key, names_.size()),
                 fmt::format("{}", values.size()));
        }
    };
    if (counts_.empty()) {
        counts_.assign(names_.size(), "1");
    }
    expect_one_each("SIZE", sizes_);
    expect_one_each("TYPE", types_);
    expect_one_each("COUNT", counts_);
    header_.fields.reserve(names_.size());
    for (std::size_t i = 0; i < names_.size(); ++i) {
        const std::optional<ScalarType> type = scalar_of(types_[i], sizes_[i]);
        if (!type) {
            fail(fmt::format("a type of field '{}' such as F of 4 bytes", excerpt(names_[i])),
                 excerpt(fmt::format("{} of {}", types_[i], sizes_[i])));
        }
        const std::optional<std::uint64_t> count = parse_count(counts_[i]);
        if (!count || *count < 1 || *count > kLongestPoint) {
            fail(fmt::format("a COUNT of field {} of at least 1", excerpt(names_[i])),
                 excerpt(counts_[i]));
        }
        header_.fields.push_back(
            {names_[i], *type, static_cast<std::uint32_t>(*count), header_.stride});
        header_.stride += header_.fields.back().size();
        if (header_.stride > kLongestPoint) {
            fail(fmt::format("at most {} bytes a point", kLongestPoint), "more");
        }
    }
}

void HeaderReader::check_points() {
    constexpr auto kMost = std::numeric_limits<std::uint64_t>::max() / kLongestPoint;
    if (!width_) {
        // Before version 0.6 there was only the number of points.
        width_ = points_;
        header_.height = 1;
    }
    if (!width_) {
        fail("a line 'WIDTH' or 'POINTS' before the data", "none");
    }
    header_.width = *width_;
    const bool fits = header_.height == 0 || header_.width <= kMost / header_.height;
    header_.points = fits ? header_.width * header_.height : 0;
    if (!fits || points_.value_or(header_.points) != header_.points) {
        fail(fmt::format("as many points as {} x {}", header_.width, header_.height),
             points_ ? fmt::format("{}", *points_) : "more than a file can hold");
    }
}

PcdHeader HeaderReader::read() {
    for (;;) {
        const Words words = next();
        if (words.empty() || words[0].starts_with('#')) {
            continue;
        }
        if (words[0] == "DATA") {
            take_data(words);
            break;
        }
        take(words);
    }
    make_fields();
    check_points();
    header_.data_offset = position_;
    header_.data_line = line_ + 1;
    return std::move(header_);
}

}  // namespace

PcdHeader read_pcd_header(const InputFile& file) {
    return HeaderReader(file).read();
}

}  // namespace knap
