#include "input/columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <set>
#include <string>

#include "knap/error.hpp"

namespace knap {

namespace {

/// A size that the compiler knows makes a copy one instruction.
template <std::size_t kSize>
void copy_fixed(const std::byte* from, std::size_t stride, std::size_t n, std::byte* to,
                bool swap) {
    for (std::size_t i = 0; i < n; ++i, from += stride, to += kSize) {
        std::memcpy(to, from, kSize);
        if (swap) {
            std::reverse(to, to + kSize);
        }
    }
}

}  // namespace

void copy_values(const std::byte* from, std::size_t stride, std::size_t n, std::byte* to,
                 std::size_t size, bool swap) {
    switch (size) {
        case 1:
            return copy_fixed<1>(from, stride, n, to, swap);
        case 2:
            return copy_fixed<2>(from, stride, n, to, swap);
        case 4:
            return copy_fixed<4>(from, stride, n, to, swap);
        case 8:
            return copy_fixed<8>(from, stride, n, to, swap);
        default:
            break;
    }
    for (std::size_t i = 0; i < n; ++i, from += stride, to += size) {
        std::memcpy(to, from, size);
        if (swap) {
            std::reverse(to, to + size);
        }
    }
}

std::vector<std::size_t> attributes_of(const SourceInfo& info) {
    std::vector<std::size_t> attributes;
    attributes.reserve(info.schema.size());
    for (std::size_t i = 0; i < info.schema.size(); ++i) {
        if (std::ranges::find(info.axes, i) == info.axes.end()) {
            attributes.push_back(i);
        }
    }
    return attributes;
}

void ColumnSelection::select(const SourceInfo& info, std::span<const std::size_t> attributes) {
    const std::vector<std::size_t> selectable = attributes_of(info);
    std::vector<std::size_t> sizes;
    sizes.reserve(attributes.size());
    for (std::size_t i = 0; i < attributes.size(); ++i) {
        const auto before = attributes.first(i);
        if (!std::ranges::binary_search(selectable, attributes[i]) ||
            std::ranges::find(before, attributes[i]) != before.end()) {
            throw ConfigError(fmt::format(
                "{}: expected attributes of the source, each once and no coordinates, found "
                "number {}",
                info.path.string(), attributes[i]));
        }
        sizes.push_back(info.schema[attributes[i]].value_size());
    }
    attributes_.assign(attributes.begin(), attributes.end());
    value_sizes_ = std::move(sizes);
}

void ColumnSelection::resize(Chunk& chunk, std::size_t points) const {
    chunk.columns.resize(attributes_.size());
    for (std::size_t i = 0; i < attributes_.size(); ++i) {
        chunk.columns[i].resize(points * value_sizes_[i]);
    }
}

void make_names_unique(std::vector<Attribute>& schema) {
    std::set<std::string> taken;
    for (const Attribute& attribute : schema) {
        taken.insert(attribute.name);
    }
    std::set<std::string> seen;
    for (Attribute& attribute : schema) {
        const std::string name = attribute.name;
        for (int n = 2; !seen.insert(attribute.name).second; ++n) {
            const std::string other = fmt::format("{} ({})", name, n);
            attribute.name = taken.insert(other).second ? other : attribute.name;
        }
    }
}

std::vector<std::size_t> value_sizes(const SourceInfo& info, std::span<const std::size_t> columns) {
    std::vector<std::size_t> sizes;
    sizes.reserve(columns.size());
    for (const std::size_t column : columns) {
        sizes.push_back(info.schema[column].value_size());
    }
    return sizes;
}

}  // namespace knap
