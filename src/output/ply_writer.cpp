#include "output/ply_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>
#include <set>
#include <string_view>

#include "base/bytes.hpp"
#include "base/scalar.hpp"

namespace knap {

namespace {

static_assert(std::endian::native == std::endian::little, "values are written as they are held");

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;

template <typename T>
void put_position(std::vector<std::byte>& buffer, const Vec3& position) {
    const std::array<T, 3> values{static_cast<T>(position.x), static_cast<T>(position.y),
                                  static_cast<T>(position.z)};
    const auto bytes = std::as_bytes(std::span(values));
    buffer.insert(buffer.end(), bytes.begin(), bytes.end());
}

// A line break within would end the comment and corrupt the header.
std::string one_line(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
    return text;
}

bool is_long_integer(ScalarType type) {
    return type == ScalarType::kInt64 || type == ScalarType::kUint64;
}

std::string_view ply_type(ScalarType type) {
    switch (type) {
        case ScalarType::kInt8:
            return "char";
        case ScalarType::kUint8:
            return "uchar";
        case ScalarType::kInt16:
            return "short";
        case ScalarType::kUint16:
            return "ushort";
        case ScalarType::kInt32:
            return "int";
        case ScalarType::kUint32:
            return "uint";
        case ScalarType::kFloat32:
            return "float";
        case ScalarType::kInt64:
        case ScalarType::kUint64:
        case ScalarType::kFloat64:
            break;
    }
    return "double";
}

/// Names of properties: words that differ from each other.
class Names {
  public:
    std::string next(std::string name) {
        std::replace_if(
            name.begin(), name.end(), [](unsigned char c) { return c <= ' ' || c == 0x7f; }, '_');
        name = name.empty() ? "attribute" : name;
        std::string result = name;
        for (int n = 2; !taken_.insert(result).second; ++n) {
            result = fmt::format("{}_{}", name, n);
        }
        return result;
    }

  private:
    std::set<std::string> taken_{"x", "y", "z"};
};

std::string header_text(const CloudHeader& header, const std::vector<std::string>& comments) {
    std::string properties;
    std::string scales;
    Names names;
    for (const Attribute& attribute : header.attributes) {
        for (int i = 0; i < attribute.components; ++i) {
            const std::string name =
                names.next(attribute.components == 1 ? attribute.name
                                                     : fmt::format("{}_{}", attribute.name, i));
            properties += fmt::format("property {} {}\n", ply_type(attribute.type), name);
            if (attribute.scale != 1 || attribute.offset != 0) {
                scales += fmt::format("comment {} means value * {} + {}\n", name, attribute.scale,
                                      attribute.offset);
            }
        }
    }
    std::string text = "ply\nformat binary_little_endian 1.0\n";
    for (const std::string& comment : comments) {
        text += fmt::format("comment {}\n", one_line(comment));
    }
    const std::string_view type =
        header.coordinates.kind == CoordinateKind::kFloat32 ? "float" : "double";
    return text + scales +
           fmt::format("element vertex {}\nproperty {} x\nproperty {} y\nproperty {} z\n",
                       header.points, type, type, type) +
           properties + "end_header\n";
}

std::vector<std::string> comments_of(const CloudHeader& header) {
    std::vector<std::string> comments{fmt::format("knap {}", KNAP_VERSION)};
    if (!header.crs.empty()) {
        comments.push_back(fmt::format("crs {}", header.crs));
    }
    return comments;
}

CloudHeader positions_only(std::uint64_t points, PlyWriter::Precision precision) {
    CloudHeader header;
    header.points = points;
    header.coordinates.kind = precision == PlyWriter::Precision::kFloat ? CoordinateKind::kFloat32
                                                                        : CoordinateKind::kFloat64;
    return header;
}

/// The double that is just this integer, if there is one.
template <typename T>
std::optional<double> exact_double(T value) {
    const auto number = static_cast<double>(value);
    // 2^63 and 2^64 are doubles that the largest integers round to, but no such integers.
    const bool in_range = number < std::ldexp(1.0, std::numeric_limits<T>::digits);
    return in_range && static_cast<T>(number) == value ? std::optional(number) : std::nullopt;
}

}  // namespace

PlyWriter::PlyWriter(const std::filesystem::path& path, std::uint64_t points, Precision precision,
                     const std::vector<std::string>& comments)
    : PlyWriter(path, positions_only(points, precision), comments) {}

PlyWriter::PlyWriter(const std::filesystem::path& path, const CloudHeader& header)
    : PlyWriter(path, header, comments_of(header)) {}

PlyWriter::PlyWriter(const std::filesystem::path& path, const CloudHeader& header,
                     const std::vector<std::string>& comments)
    : CloudWriter(path, header.points, header.attributes),
      attributes_(header.attributes),
      precision_(header.coordinates.kind == CoordinateKind::kFloat32 ? Precision::kFloat
                                                                     : Precision::kDouble),
      has_long_integers_(std::any_of(attributes_.begin(), attributes_.end(),
                                     [](const Attribute& a) { return is_long_integer(a.type); })) {
    file().write(header_text(header, comments));
    buffer_.reserve(kBufferBytes + 3 * sizeof(double) + row_bytes());
}

void PlyWriter::put(std::span<const Vec3> positions, std::span<const std::byte> rows) {
    for (std::size_t i = 0; i < positions.size(); ++i) {
        if (precision_ == Precision::kFloat) {
            put_position<float>(buffer_, positions[i]);
        } else {
            put_position<double>(buffer_, positions[i]);
        }
        put_row(rows.subspan(i * row_bytes(), row_bytes()), i);
        if (buffer_.size() >= kBufferBytes) {
            flush();
        }
    }
}

void PlyWriter::put_row(std::span<const std::byte> row, std::size_t point) {
    if (!has_long_integers_) {
        buffer_.insert(buffer_.end(), row.begin(), row.end());
        return;
    }
    for (const Attribute& attribute : attributes_) {
        const std::span<const std::byte> values = row.first(attribute.value_size());
        row = row.subspan(values.size());
        if (!is_long_integer(attribute.type)) {
            buffer_.insert(buffer_.end(), values.begin(), values.end());
            continue;
        }
        visit_scalar(attribute.type, [&](auto tag) {
            using T = typename decltype(tag)::Type;
            for (std::size_t at = 0; at < values.size(); at += sizeof(T)) {
                T value;
                std::memcpy(&value, values.data() + at, sizeof value);
                if constexpr (std::is_integral_v<T>) {
                    const std::optional<double> number = exact_double(value);
                    if (!number) {
                        fail_at(point, attribute.name,
                                "an integer that a double holds, as PLY has none of 64 bits",
                                fmt::format("{}", value));
                    }
                    knap::put(buffer_, *number);
                }
            }
        });
    }
}

void PlyWriter::put_end() {
    flush();
}

void PlyWriter::flush() {
    file().write(buffer_);
    buffer_.clear();
}

}  // namespace knap
