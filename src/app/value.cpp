#include "app/value.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>

#include "knap/error.hpp"

namespace knap::app {

namespace {

[[noreturn]] void fail(std::string_view where, std::string_view expected, std::string_view text) {
    throw ConfigError(fmt::format("{}: expected {}, found \"{}\"", where, expected, text));
}

template <typename T>
T parse_whole(std::string_view text, std::string_view where, std::string_view expected) {
    T value{};
    const char* const end = text.data() + text.size();
    const auto [stopped, error] = std::from_chars(text.data(), end, value);
    if (error == std::errc::result_out_of_range && stopped == end) {
        fail(where, fmt::format("{} that fits {} bits", expected, 8 * sizeof(T)), text);
    }
    if (error != std::errc{} || stopped != end) {
        fail(where, expected, text);
    }
    return value;
}

constexpr std::string_view kSize = "a size such as 4GiB, 512MiB or 1073741824";

struct Kind {
    std::string_view operator()(double* /*field*/) const { return "a number"; }
    std::string_view operator()(int* /*field*/) const { return "an integer"; }
    std::string_view operator()(std::uint64_t* /*field*/) const { return "an integer >= 0"; }
    std::string_view operator()(Bytes /*field*/) const { return kSize; }
    std::string_view operator()(const Choice& /*field*/) const { return "the name of one"; }
    std::string_view operator()(bool* /*field*/) const { return "true or false"; }
    std::string_view operator()(std::string* /*field*/) const { return "text"; }
    std::string_view operator()(std::vector<std::string>* /*field*/) const {
        return "a list of text";
    }
};

struct Setter {
    std::string_view text;
    std::string_view where;
    bool lists_names = false;  ///< a list is of names between commas, which a path may have too

    void operator()(double* value) const { *value = parse_number(text, where); }
    void operator()(int* value) const { *value = parse_whole<int>(text, where, "an integer"); }
    void operator()(std::uint64_t* value) const { *value = parse_count(text, where); }
    void operator()(Bytes size) const { *size.value = parse_size(text, where); }
    void operator()(const Choice& choice) const { app::choose(choice, text, where); }
    void operator()(bool* value) const {
        if (text != "true" && text != "false") {
            fail(where, "true or false", text);
        }
        *value = text == "true";
    }
    void operator()(std::string* value) const { *value = text; }
    void operator()(std::vector<std::string>* value) const {
        if (!lists_names) {
            *value = {std::string(text)};
            return;
        }
        value->clear();
        for (std::size_t begin = 0; begin <= text.size();) {
            const std::size_t end = std::min(text.find(',', begin), text.size());
            value->emplace_back(text.substr(begin, end - begin));
            begin = end + 1;
        }
    }
};

}  // namespace

double parse_number(std::string_view text, std::string_view where) {
    const auto value = parse_whole<double>(text, where, "a number");
    if (std::isnan(value)) {
        fail(where, "a number", text);
    }
    return value;
}

std::uint64_t parse_count(std::string_view text, std::string_view where) {
    return parse_whole<std::uint64_t>(text, where, "an integer >= 0");
}

std::uint64_t parse_size(std::string_view text, std::string_view where) {
    constexpr std::array<std::string_view, 4> kUnits{"KiB", "MiB", "GiB", "TiB"};
    double factor = 1;
    for (const std::string_view unit : kUnits) {
        factor *= 1024;
        if (!text.ends_with(unit)) {
            continue;
        }
        double amount = 0;
        const char* const end = text.data() + text.size() - unit.size();
        const auto [stopped, error] =
            std::from_chars(text.data(), end, amount, std::chars_format::fixed);
        // Below 2^63, so that the cast is defined; not true of NaN.
        const bool fits = amount >= 0 && amount * factor < 9.2e18;
        if (error != std::errc{} || stopped != end || !fits) {
            fail(where, kSize, text);
        }
        return static_cast<std::uint64_t>(amount * factor);
    }
    return parse_whole<std::uint64_t>(text, where, kSize);
}

void choose(const Choice& choice, std::string_view text, std::string_view where) {
    if (!choice.choose(text)) {
        fail(where, fmt::format("{}", fmt::join(choice.names, " or ")), text);
    }
}

void set_parameter(Job& job, const Parameter& parameter, std::string_view text,
                   std::string_view where) {
    const bool lists_names = parameter.key != "input";
    std::visit(Setter{text, where, lists_names}, parameter.field(job));
    validate(parameter, job);
}

std::string_view kind_of(const Parameter& parameter) {
    Job job;
    return std::visit(Kind{}, parameter.field(job));
}

}  // namespace knap::app
