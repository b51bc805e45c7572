#include "app/format.hpp"

#include <fmt/format.h>

#include <cmath>

namespace knap::app {

std::string format_rate(double rate) {
    if (!(rate > 0) || !std::isfinite(rate)) {
        return "-";
    }
    if (rate >= 1e6) {
        return fmt::format("{:.2f} M", rate / 1e6);
    }
    return rate >= 1e3 ? fmt::format("{:.0f} k", rate / 1e3) : fmt::format("{:.0f}", rate);
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
