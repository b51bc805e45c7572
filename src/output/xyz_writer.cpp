#include "output/xyz_writer.hpp"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <iterator>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "base/scalar.hpp"

namespace knap {

namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;

bool is_letter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' ||
           static_cast<unsigned char>(c) >= 0x80;
}

/// A word that no reader takes for a number, a comment or several columns.
std::string column_name(std::string name) {
    std::replace_if(
        name.begin(), name.end(),
        [](char c) {
            return !is_letter(c) && !(c >= '0' && c <= '9') && c != '.' && c != '-' && c != '(' &&
                   c != ')';
        },
        '_');
    std::string low = name.substr(0, 3);
    std::transform(low.begin(), low.end(), low.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const bool number_like = name.empty() || !is_letter(name[0]) || low == "nan" || low == "inf";
    return number_like ? "_" + name : name;
}

std::string names_of(std::span<const Attribute> attributes) {
    std::set<std::string> taken{"x", "y", "z", "X", "Y", "Z"};
    std::string line = "x y z";
    for (const Attribute& attribute : attributes) {
        for (int i = 0; i < attribute.components; ++i) {
            const std::string name =
                column_name(attribute.components == 1 ? attribute.name
                                                      : fmt::format("{}_{}", attribute.name, i));
            std::string unique = name;
            for (int n = 2; !taken.insert(unique).second; ++n) {
                unique = fmt::format("{}_{}", name, n);
            }
            line += " " + unique;
        }
    }
    return line + "\n";
}

}  // namespace

XyzWriter::XyzWriter(const std::filesystem::path& path, std::uint64_t points,
                     std::vector<Attribute> attributes)
    : CloudWriter(path, points, attributes), attributes_(std::move(attributes)) {
    if (!attributes_.empty()) {
        file().write(names_of(attributes_));
    }
}

void XyzWriter::put(std::span<const Vec3> positions, std::span<const std::byte> rows) {
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const Vec3& p = positions[i];
        fmt::format_to(std::back_inserter(text_), "{} {} {}", p.x, p.y, p.z);
        put_row(rows.subspan(i * row_bytes(), row_bytes()));
        text_.push_back('\n');
        if (text_.size() >= kBufferBytes) {
            flush();
        }
    }
}

void XyzWriter::put_row(std::span<const std::byte> row) {
    for (const Attribute& attribute : attributes_) {
        visit_scalar(attribute.type, [&](auto tag) {
            using T = typename decltype(tag)::Type;
            for (int i = 0; i < attribute.components; ++i) {
                T value;
                std::memcpy(&value, row.data(), sizeof value);
                row = row.subspan(sizeof value);
                // Bytes are numbers here, not letters.
                if constexpr (sizeof value == 1) {
                    fmt::format_to(std::back_inserter(text_), " {}", static_cast<int>(value));
                } else {
                    fmt::format_to(std::back_inserter(text_), " {}", value);
                }
            }
        });
    }
}

void XyzWriter::put_end() {
    flush();
}

void XyzWriter::flush() {
    file().write(std::string_view(text_.data(), text_.size()));
    text_.clear();
}

}  // namespace knap
