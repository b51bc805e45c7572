#include "emit/attribute_plan.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <type_traits>
#include <utility>

#include "base/scalar.hpp"
#include "emit/value_limits.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

// From small to large, and of one size those of whole numbers first.
constexpr std::array kBySize{ScalarType::kInt8,    ScalarType::kUint8, ScalarType::kInt16,
                             ScalarType::kUint16,  ScalarType::kInt32, ScalarType::kUint32,
                             ScalarType::kFloat32, ScalarType::kInt64, ScalarType::kUint64,
                             ScalarType::kFloat64};

using Measure = std::pair<std::string_view, std::string_view>;
constexpr std::array kMeasures{Measure{"curvature", "knap: |H|, 1 / unit"},
                               Measure{"range", "knap: stands for, units"}};

struct Range {
    bool floating = false;
    bool negative = false;
    int digits = 0;  ///< of whole numbers, binary
};

Range range_of(ScalarType type) {
    return visit_scalar(type, [](auto tag) {
        using Limits = std::numeric_limits<typename decltype(tag)::Type>;
        return Range{!Limits::is_integer, Limits::is_signed, Limits::digits};
    });
}

/// True if every value of `other` is one of `type`.
bool holds(ScalarType type, ScalarType other) {
    const Range large = range_of(type);
    const Range small = range_of(other);
    return (large.floating || !small.floating) && (large.negative || !small.negative) &&
           large.digits >= small.digits;
}

std::optional<ScalarType> smallest_for(ScalarType a, ScalarType b) {
    const auto* const found = std::find_if(kBySize.begin(), kBySize.end(), [&](ScalarType type) {
        return holds(type, a) && holds(type, b);
    });
    return found == kBySize.end() ? std::nullopt : std::optional(*found);
}

bool is_word(std::span<const std::string> wanted, std::string_view word) {
    return wanted.size() == 1 && wanted.front() == word;
}

/// An attribute of the output, and the first source that has it.
struct Found {
    std::size_t attribute = 0;
    const SourceInfo* source = nullptr;
};

[[noreturn]] void throw_different(const Attribute& attribute, std::string_view what,
                                  const SourceInfo& first, const SourceInfo& other,
                                  std::string_view expected, std::string_view found) {
    throw ConfigError(fmt::format(
        "{}: attribute \"{}\": expected {} {} as in {}, found {}; name those to be carried in "
        "output.attributes (--attributes), without it",
        other.path.string(), attribute.name, what, expected, first.path.string(), found));
}

/// Makes `known` hold what `other` has.
void merge(Attribute& known, const SourceInfo& first, const Attribute& other,
           const SourceInfo& source) {
    const auto require = [&](std::string_view what, auto expected, auto found) {
        if (expected != found) {
            throw_different(known, what, first, source, fmt::to_string(expected),
                            fmt::to_string(found));
        }
    };
    require("components", known.components, other.components);
    require("scale", known.scale, other.scale);
    require("offset", known.offset, other.offset);
    const std::optional<ScalarType> type = smallest_for(known.type, other.type);
    if (!type) {
        throw_different(known, "a type that one type holds beside", first, source,
                        to_string(known.type), to_string(other.type));
    }
    known.limits = common_limits(known, other, *type);
    known.type = *type;
    if (known.description.empty()) {
        known.description = other.description;
    }
}

/// A point of a source without an attribute has 0, whatever the others are said to have at least.
void drop_bounds_of_some(AttributePlan& plan) {
    std::vector<std::size_t> sources(plan.attributes.size());
    for (const std::vector<SourceColumn>& source : plan.columns) {
        for (const SourceColumn& column : source) {
            ++sources[column.attribute];
        }
    }
    for (std::size_t i = 0; i < sources.size(); ++i) {
        if (sources[i] < plan.columns.size()) {
            plan.attributes[i].limits.least.clear();
            plan.attributes[i].limits.greatest.clear();
        }
    }
}

void require_all_found(std::span<const SourceInfo> sources, std::span<const std::string> wanted,
                       const std::map<std::string, Found>& found) {
    for (const std::string& name : wanted) {
        if (found.contains(name)) {
            continue;
        }
        std::vector<std::string> there;
        for (const SourceInfo& source : sources) {
            for (const std::size_t column : attributes_of(source)) {
                const std::string& other = source.schema[column].name;
                if (std::find(there.begin(), there.end(), other) == there.end()) {
                    there.push_back(other);
                }
            }
        }
        throw ConfigError(fmt::format(
            "output.attributes (--attributes): expected attributes of the input ({}), found \"{}\"",
            there.empty() ? "it has none" : fmt::format("{}", fmt::join(there, ", ")), name));
    }
}

/// Copies the values of some points from a column into rows.
struct Copy {
    const std::byte* column;
    std::size_t value_size;  ///< of a point in the column
    std::span<const std::uint32_t> points;
    std::byte* out;  ///< in the first row
    std::size_t row_size;

    void as_they_are() const {
        for (std::size_t i = 0; i < points.size(); ++i) {
            std::memcpy(out + i * row_size, column + points[i] * value_size, value_size);
        }
    }

    template <typename From, typename To>
    void converted() const {
        for (std::size_t i = 0; i < points.size(); ++i) {
            for (std::size_t k = 0; k < value_size / sizeof(From); ++k) {
                From value{};
                std::memcpy(&value, column + points[i] * value_size + k * sizeof value,
                            sizeof value);
                // Only types that hold all values of From are asked for: the sign is kept.
                const To as_held = static_cast<To>(value);  // NOLINT(bugprone-signed-char-misuse)
                std::memcpy(out + i * row_size + k * sizeof as_held, &as_held, sizeof as_held);
            }
        }
    }
};

}  // namespace

RowLayout row_layout(std::span<const Attribute> attributes) {
    RowLayout layout;
    for (const Attribute& attribute : attributes) {
        layout.offsets.push_back(layout.row_size);
        layout.row_size += attribute.value_size();
    }
    return layout;
}

std::vector<std::vector<std::size_t>> AttributePlan::selected() const {
    std::vector<std::vector<std::size_t>> result;
    for (const std::vector<SourceColumn>& source : columns) {
        std::vector<std::size_t>& indices = result.emplace_back();
        for (const SourceColumn& column : source) {
            indices.push_back(column.column);
        }
    }
    return result;
}

void AttributePlan::append_rows(std::size_t source, const Chunk& chunk,
                                std::span<const std::uint32_t> points,
                                std::vector<std::byte>& rows) const {
    const std::size_t first = rows.size();
    rows.resize(first + points.size() * row_size);
    for (std::size_t i = 0; i < columns[source].size(); ++i) {
        const SourceColumn& column = columns[source][i];
        const Attribute& attribute = attributes[column.attribute];
        const Copy copy{chunk.columns[i].data(),
                        size_of(column.type) * static_cast<std::size_t>(attribute.components),
                        points, rows.data() + first + offsets[column.attribute], row_size};
        if (column.type == attribute.type) {
            copy.as_they_are();
            continue;
        }
        visit_scalar(column.type, [&](auto from) {
            visit_scalar(attribute.type, [&](auto to) {
                copy.converted<typename decltype(from)::Type, typename decltype(to)::Type>();
            });
        });
    }
}

AttributePlan plan_attributes(std::span<const SourceInfo> sources,
                              std::span<const std::string> wanted) {
    AttributePlan plan;
    plan.columns.resize(sources.size());
    if (is_word(wanted, "none")) {
        return plan;
    }
    const bool all = is_word(wanted, "all");
    std::map<std::string, Found> found;
    for (std::size_t i = 0; i < sources.size(); ++i) {
        const SourceInfo& source = sources[i];
        for (const std::size_t column : attributes_of(source)) {
            const Attribute& attribute = source.schema[column];
            if (!all && std::find(wanted.begin(), wanted.end(), attribute.name) == wanted.end()) {
                continue;
            }
            const auto [known, is_new] =
                found.emplace(attribute.name, Found{plan.attributes.size(), &source});
            if (is_new) {
                plan.attributes.push_back(attribute);
            } else {
                merge(plan.attributes[known->second.attribute], *known->second.source, attribute,
                      source);
            }
            plan.columns[i].push_back({column, known->second.attribute, attribute.type});
        }
    }
    drop_bounds_of_some(plan);
    if (!all) {
        require_all_found(sources, wanted, found);
    }
    RowLayout layout = row_layout(plan.attributes);
    plan.offsets = std::move(layout.offsets);
    plan.row_size = layout.row_size;
    return plan;
}

AttributePlan plan_output(std::span<const SourceInfo> sources, const OutputParams& output) {
    AttributePlan plan = plan_attributes(sources, output.attributes);
    if (!output.measures) {
        return plan;
    }
    for (const auto& [name, description] : kMeasures) {
        for (const Attribute& attribute : plan.attributes) {
            if (attribute.name == name) {
                throw ConfigError(fmt::format(
                    "output.measures (--measures): expected inputs without an attribute {}, found "
                    "one; leave it out by output.attributes",
                    name));
            }
        }
        plan.attributes.push_back({std::string(name), ScalarType::kFloat32, 1});
        plan.attributes.back().description = description;
    }
    RowLayout layout = row_layout(plan.attributes);
    plan.offsets = std::move(layout.offsets);
    plan.row_size = layout.row_size;
    plan.measures = true;
    return plan;
}

std::vector<std::string> attribute_notes(const SourceTable& sources, const AttributePlan& plan) {
    const std::size_t of_sources = plan.attributes.size() - (plan.measures ? kMeasures.size() : 0);
    std::vector<std::uint64_t> without(of_sources);
    std::vector<std::string> left_out;
    std::vector<std::string> unsupported;
    const auto add = [](std::vector<std::string>& names, const std::string& name) {
        if (std::find(names.begin(), names.end(), name) == names.end()) {
            names.push_back(name);
        }
    };
    for (std::size_t i = 0; i < sources.sources().size(); ++i) {
        const SourceEntry& source = sources.sources()[i];
        std::vector<bool> has(of_sources);
        for (const SourceColumn& column : plan.columns[i]) {
            has[column.attribute] = true;
        }
        for (std::size_t attribute = 0; attribute < has.size(); ++attribute) {
            without[attribute] += has[attribute] ? 0 : source.points;
        }
        for (const std::size_t column : attributes_of(source.info)) {
            const auto is_it = [&](const SourceColumn& taken) { return taken.column == column; };
            if (std::none_of(plan.columns[i].begin(), plan.columns[i].end(), is_it)) {
                add(left_out, source.info.schema[column].name);
            }
        }
        for (const std::string& name : source.info.unsupported) {
            add(unsupported, name);
        }
    }
    std::vector<std::string> notes;
    for (std::size_t attribute = 0; attribute < without.size(); ++attribute) {
        if (without[attribute] > 0) {
            notes.push_back(
                fmt::format("attribute \"{}\" is 0 in {} input points, whose files do "
                            "not have it",
                            plan.attributes[attribute].name, without[attribute]));
        }
    }
    if (!left_out.empty()) {
        notes.push_back(fmt::format("{} attributes stay behind, as output.attributes says: {}",
                                    left_out.size(), fmt::join(left_out, ", ")));
    }
    if (!unsupported.empty()) {
        notes.push_back(
            fmt::format("what knap cannot carry stays behind: {}", fmt::join(unsupported, ", ")));
    }
    return notes;
}

}  // namespace knap
