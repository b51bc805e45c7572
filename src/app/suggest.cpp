#include "app/suggest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "knap/error.hpp"

namespace knap::app {

namespace {

/// Levenshtein distance, row by row.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
            diagonal = row[j + 1];
            row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
        }
    }
    return row[b.size()];
}

std::string_view last_part(std::string_view key) {
    return key.substr(key.rfind('.') + 1);
}

std::size_t distance(std::string_view word, std::string_view candidate) {
    const std::string_view section = candidate.substr(0, candidate.find('.'));
    return std::min({edit_distance(word, candidate), edit_distance(word, section),
                     edit_distance(last_part(word), last_part(candidate)) + 1});
}

}  // namespace

std::string_view nearest(std::string_view word, std::span<const std::string_view> candidates) {
    return *std::min_element(candidates.begin(), candidates.end(),
                             [word](std::string_view a, std::string_view b) {
                                 return distance(word, a) < distance(word, b);
                             });
}

const Parameter& find_parameter(std::string_view key, std::string_view where) {
    std::vector<std::string_view> keys;
    for (const Parameter& parameter : parameters()) {
        if (parameter.key == key) {
            return parameter;
        }
        keys.push_back(parameter.key);
    }
    throw ConfigError(
        fmt::format("{}: unknown key {}; did you mean {}?", where, key, nearest(key, keys)));
}

}  // namespace knap::app
