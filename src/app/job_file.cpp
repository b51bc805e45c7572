#include "app/job_file.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/suggest.hpp"
#include "app/value.hpp"
#include "base/file.hpp"
#include "knap/error.hpp"

namespace knap::app {

namespace {

/// A value of the file under its whole key: "range.alpha".
struct Entry {
    std::string key;
    std::uint32_t line = 0;
    const toml::node* node = nullptr;
};

bool is_known(std::string_view key) {
    return std::ranges::any_of(parameters(), [key](const Parameter& p) { return p.key == key; });
}

/// Appends the values of a table and of the tables in it. An empty table is an entry of its own, so
/// that a misspelt one is not passed over; so is a table where a value should be.
void collect(const toml::table& table, const std::string& prefix, std::vector<Entry>& entries) {
    for (const auto& [name, node] : table) {
        const std::string key = prefix + std::string(name.str());
        const toml::table* const inner = node.as_table();
        const std::string inner_prefix = key + ".";
        const bool is_section = std::ranges::any_of(
            parameters(), [&](const Parameter& p) { return p.key.starts_with(inner_prefix); });
        if (inner != nullptr && (!inner->empty() || is_section) && !is_known(key)) {
            collect(*inner, inner_prefix, entries);
        } else {
            entries.push_back({key, name.source().begin.line, &node});
        }
    }
}

std::string_view found_type(const toml::node& node) {
    switch (node.type()) {
        case toml::node_type::table:
            return "a table";
        case toml::node_type::array:
            return "a list";
        case toml::node_type::string:
            return "text";
        case toml::node_type::integer:
            return "an integer";
        case toml::node_type::floating_point:
            return "a number";
        case toml::node_type::boolean:
            return "true or false";
        default:
            return "a date or time";
    }
}

/// An integer that fits T.
template <typename T>
std::optional<T> integer(const toml::node& node) {
    const std::optional<std::int64_t> value = node.value_exact<std::int64_t>();
    if (!value || !std::in_range<T>(*value)) {
        return std::nullopt;
    }
    return static_cast<T>(*value);
}

/// Puts a node into a field; false if it is of another type.
struct Setter {
    const toml::node& node;
    std::string_view where;

    bool operator()(double* field) const {
        return assign(*field, node.is_number() ? node.value<double>() : std::nullopt);
    }
    bool operator()(int* field) const { return assign(*field, integer<int>(node)); }
    bool operator()(std::uint64_t* field) const {
        return assign(*field, integer<std::uint64_t>(node));
    }
    bool operator()(Bytes field) const {
        if (const auto text = node.value_exact<std::string>()) {
            *field.value = parse_size(*text, where);
            return true;
        }
        return (*this)(field.value);
    }
    bool operator()(const Choice& choice) const {
        const auto text = node.value_exact<std::string>();
        if (!text) {
            return false;
        }
        choose(choice, *text, where);
        return true;
    }
    bool operator()(bool* field) const { return assign(*field, node.value_exact<bool>()); }
    bool operator()(std::string* field) const {
        return assign(*field, node.value_exact<std::string>());
    }
    bool operator()(std::vector<std::string>* field) const {
        const toml::array* const list = node.as_array();
        if (list == nullptr) {
            return false;
        }
        field->clear();
        for (const toml::node& item : *list) {
            const auto text = item.value_exact<std::string>();
            if (!text) {
                return false;
            }
            field->push_back(*text);
        }
        return true;
    }

    template <typename T>
    static bool assign(T& field, const std::optional<T>& value) {
        field = value.value_or(field);
        return value.has_value();
    }
};

/// What was found, for the message of a value that does not fit: its type, and the value where the
/// type alone would not say what is wrong.
std::string describe(const toml::node& node) {
    if (const auto value = node.value_exact<std::int64_t>()) {
        return fmt::format("the integer {}", *value);
    }
    if (const auto value = node.value_exact<double>()) {
        return fmt::format("the number {}", *value);
    }
    if (const auto value = node.value_exact<std::string>()) {
        return fmt::format("the text \"{}\"", *value);
    }
    if (const auto value = node.value_exact<bool>()) {
        return *value ? "true" : "false";
    }
    if (const toml::array* const list = node.as_array()) {
        for (const toml::node& item : *list) {
            if (!item.is_string()) {
                return fmt::format("a list with {} in it", found_type(item));
            }
        }
    }
    return std::string(found_type(node));
}

void set_entry(Job& job, const Entry& entry, const std::string& file) {
    const std::string place = fmt::format("{}:{}", file, entry.line);
    const Parameter& parameter = find_parameter(entry.key, place);
    const std::string where = fmt::format("{}: {}", place, entry.key);
    if (!std::visit(Setter{*entry.node, where}, parameter.field(job))) {
        throw ConfigError(fmt::format("{}: expected {}, found {}", where, kind_of(parameter),
                                      describe(*entry.node)));
    }
    try {
        validate(parameter, job);
    } catch (const ConfigError& error) {
        throw ConfigError(fmt::format("{}: {}", place, error.what()));
    }
}

toml::table parse(const std::string& text, const std::string& file) {
    try {
        return toml::parse(text, file);
    } catch (const toml::parse_error& error) {
        throw ConfigError(fmt::format("{}:{}:{}: expected TOML, found: {}", file,
                                      error.source().begin.line, error.source().begin.column,
                                      error.description()));
    }
}

}  // namespace

Job read_job_file(const std::filesystem::path& path) {
    const std::string file = path.string();
    const toml::table table = parse(read_text_file(path), file);
    std::vector<Entry> entries;
    collect(table, "", entries);
    // The table is sorted by key; people read their file from the top.
    std::ranges::stable_sort(entries, {}, &Entry::line);
    Job job;
    for (const Entry& entry : entries) {
        set_entry(job, entry, file);
    }
    return job;
}

}  // namespace knap::app
