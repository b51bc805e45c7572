#include "app/format.hpp"

#include <fmt/format.h>

#include <cmath>

namespace knap::app {

std::string format_count(std::uint64_t count) {
    const std::string digits = fmt::format("{}", count);
    std::string text;
    for (std::size_t i = 0; i < digits.size(); ++i) {
        if (i > 0 && (digits.size() - i) % 3 == 0) {
            text += ',';
        }
        text += digits[i];
    }
    return text;
}

std::string format_rate(double rate) {
    if (!(rate > 0) || !std::isfinite(rate)) {
        return "-";
    }
    if (rate >= 1e6) {
        return fmt::format("{:.2f} M", rate / 1e6);
    }
    return rate >= 1e3 ? fmt::format("{:.0f} k", rate / 1e3) : fmt::format("{:.0f}", rate);
}

std::string format_seconds(double seconds) {
    if (seconds < 60) {
        return fmt::format("{:.2f} s", seconds);
    }
    const auto whole = static_cast<std::uint64_t>(std::llround(seconds));
    if (whole < 3600) {
        return fmt::format("{} min {:02} s", whole / 60, whole % 60);
    }
    return fmt::format("{} h {:02} min", whole / 3600, whole % 3600 / 60);
}

std::string format_share(std::uint64_t part, std::uint64_t whole) {
    if (whole == 0) {
        return "-";
    }
    return fmt::format("{:.1f} %", 100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

std::string one_line(const std::string& text) {
    std::string line;
    for (const char c : text) {
        if (c == '\n') {
            line += line.empty() ? "" : "; ";
        } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
            line += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
        } else {
            line += c;
        }
    }
    while (line.ends_with("; ")) {
        line.resize(line.size() - 2);
    }
    return line;
}

}  // namespace knap::app
