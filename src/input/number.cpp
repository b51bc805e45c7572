#include "input/number.hpp"

#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <system_error>
#include <type_traits>

#include "base/scalar.hpp"

namespace knap {

namespace {

/// from_chars knows no leading plus.
std::string_view without_plus(std::string_view text) {
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') {
        text.remove_prefix(1);
    }
    return text;
}

template <typename T>
std::optional<T> parse(std::string_view text) {
    text = without_plus(text);
    const char* end = text.data() + text.size();
    T value{};
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (stop != end || text.empty()) {
        return std::nullopt;
    }
    if (error == std::errc{}) {
        return value;
    }
    if constexpr (!std::is_same_v<T, long double>) {
        // Out of range: the wider type tells too large from too small.
        if (error == std::errc::result_out_of_range) {
            if (const std::optional<long double> wide = parse<long double>(text)) {
                return static_cast<T>(*wide);
            }
        }
    }
    return std::nullopt;
}

}  // namespace

std::optional<double> parse_double(std::string_view text) {
    return parse<double>(text);
}

std::optional<float> parse_float(std::string_view text) {
    return parse<float>(text);
}

std::optional<double> parse_scalar(std::string_view text, ScalarType type) {
    if (type == ScalarType::kFloat64) {
        return parse_double(text);
    }
    if (type == ScalarType::kFloat32) {
        const std::optional<float> value = parse_float(text);
        return value ? std::optional<double>(*value) : std::nullopt;
    }
    const std::optional<double> value = parse_double(text);
    if (!value || std::trunc(*value) != *value) {
        return std::nullopt;
    }
    const bool fits = visit_scalar(type, [&](auto tag) {
        using Limits = std::numeric_limits<typename decltype(tag)::Type>;
        // The largest value of 64 bits is no double; the power of two behind it is.
        return *value >= static_cast<double>(Limits::lowest()) &&
               *value < std::ldexp(1.0, Limits::digits);
    });
    return fits ? value : std::nullopt;
}

bool parse_value(std::string_view text, ScalarType type, std::byte* to) {
    return visit_scalar(type, [&](auto tag) {
        using T = typename decltype(tag)::Type;
        T value{};
        if constexpr (std::is_integral_v<T>) {
            // Beyond 2^53 a double would round.
            const std::string_view digits = without_plus(text);
            const char* end = digits.data() + digits.size();
            const auto [stop, error] = std::from_chars(digits.data(), end, value);
            if (stop == end && error == std::errc{} && !digits.empty()) {
                std::memcpy(to, &value, sizeof value);
                return true;
            }
        }
        const std::optional<double> number = parse_scalar(text, type);
        if (number) {
            value = static_cast<T>(*number);
            std::memcpy(to, &value, sizeof value);
        }
        return number.has_value();
    });
}

std::optional<std::uint64_t> parse_count(std::string_view text) {
    std::uint64_t value = 0;
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (stop != end || error != std::errc{} || text.empty()) {
        return std::nullopt;
    }
    return value;
}

std::string excerpt(std::string_view text) {
    constexpr std::size_t kLongest = 40;
    std::string shown = "'";
    for (const char c : text.substr(0, kLongest)) {
        shown += c >= 0x20 && c < 0x7f ? c : '?';
    }
    shown += text.size() > kLongest ? "...'" : "'";
    return shown;
}

}  // namespace knap
