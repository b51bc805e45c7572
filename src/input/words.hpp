#pragma once

#include <cstddef>
#include <string_view>

namespace knap {

constexpr bool is_space(char c) {
    return c == ' ' || c == '\t' || c == '\f' || c == '\v';
}

/// Takes the first word off `line`; empty if there is none.
inline std::string_view take_word(std::string_view& line) {
    const char* begin = line.data();
    const char* const end = begin + line.size();
    while (begin != end && is_space(*begin)) {
        ++begin;
    }
    const char* stop = begin;
    while (stop != end && !is_space(*stop)) {
        ++stop;
    }
    line = std::string_view(stop, static_cast<std::size_t>(end - stop));
    return {begin, static_cast<std::size_t>(stop - begin)};
}

constexpr std::string_view trimmed(std::string_view text) {
    while (!text.empty() && is_space(text.front())) {
        text.remove_prefix(1);
    }
    while (!text.empty() && is_space(text.back())) {
        text.remove_suffix(1);
    }
    return text;
}

}  // namespace knap
