#include "store/las_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace knap {

namespace {

constexpr std::string_view kDigits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr char kPadding = '=';

/// Base 64 as RFC 4648 has it.
std::string to_base64(std::span<const std::byte> bytes) {
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t at = 0; at < bytes.size(); at += 3) {
        const std::size_t some = std::min<std::size_t>(3, bytes.size() - at);
        std::uint32_t group = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            group = group << 8U | (i < some ? std::to_integer<std::uint32_t>(bytes[at + i]) : 0);
        }
        for (std::size_t i = 0; i < 4; ++i) {
            text += i <= some ? kDigits[(group >> (18 - 6 * i)) & 63U] : kPadding;
        }
    }
    return text;
}

std::vector<std::byte> from_base64(const JsonNode& node) {
    const std::string text = node.text();
    std::size_t digits = text.size();
    while (digits > 0 && text.size() - digits < 2 && text[digits - 1] == kPadding) {
        --digits;
    }
    std::vector<std::byte> bytes;
    bytes.reserve(digits * 3 / 4);
    std::uint32_t group = 0;
    for (std::size_t i = 0; i < digits; ++i) {
        const std::size_t digit = kDigits.find(text[i]);
        if (digit == std::string_view::npos) {
            node.fail("base 64", fmt::format("'{}' at {}", text[i], i));
        }
        group = group << 6U | static_cast<std::uint32_t>(digit);
        // From the second digit of four on, each completes a byte.
        if (i % 4 != 0) {
            bytes.push_back(static_cast<std::byte>(group >> (6 - 2 * (i % 4))));
        }
    }
    if (text.size() % 4 != 0 || digits % 4 == 1) {
        node.fail("base 64", fmt::format("{} digits", text.size()));
    }
    return bytes;
}

template <typename T>
T whole(const JsonNode& node) {
    const std::uint64_t value = node.count();
    if (value > static_cast<std::uint64_t>(std::numeric_limits<T>::max())) {
        node.fail(fmt::format("at most {}", std::numeric_limits<T>::max()), fmt::to_string(value));
    }
    return static_cast<T>(value);
}

Json record_json(const LasVlr& record) {
    return {{"user_id", record.user_id},
            {"record_id", record.record_id},
            {"description", record.description},
            {"extended", record.extended ? 1 : 0},
            {"content", to_base64(record.content)}};
}

LasVlr record_from(const JsonNode& node) {
    return {.user_id = node.at("user_id").text(),
            .record_id = whole<std::uint16_t>(node.at("record_id")),
            .description = node.at("description").text(),
            .extended = node.at("extended").count() != 0,
            .content = from_base64(node.at("content"))};
}

}  // namespace

Json las_json(const LasHeaderInfo& las) {
    Json records = Json::array();
    for (const LasVlr& record : las.records) {
        records.push_back(record_json(record));
    }
    return {{"version_minor", las.version_minor},
            {"point_format", las.point_format},
            {"file_source_id", las.file_source_id},
            {"global_encoding", las.global_encoding},
            {"project_id", to_base64(las.project_id)},
            {"system_identifier", las.system_identifier},
            {"generating_software", las.generating_software},
            {"creation_day", las.creation_day},
            {"creation_year", las.creation_year},
            {"records", records}};
}

LasHeaderInfo las_from(const JsonNode& node) {
    LasHeaderInfo las;
    las.version_minor = whole<std::uint8_t>(node.at("version_minor"));
    las.point_format = whole<std::uint8_t>(node.at("point_format"));
    las.file_source_id = whole<std::uint16_t>(node.at("file_source_id"));
    las.global_encoding = whole<std::uint16_t>(node.at("global_encoding"));
    const std::vector<std::byte> id = from_base64(node.at("project_id"));
    if (id.size() != las.project_id.size()) {
        node.at("project_id")
            .fail(fmt::format("{} bytes", las.project_id.size()), fmt::to_string(id.size()));
    }
    std::copy(id.begin(), id.end(), las.project_id.begin());
    las.system_identifier = node.at("system_identifier").text();
    las.generating_software = node.at("generating_software").text();
    las.creation_day = whole<std::uint16_t>(node.at("creation_day"));
    las.creation_year = whole<std::uint16_t>(node.at("creation_year"));
    const std::vector<JsonNode> records = node.at("records").items();
    las.records.reserve(records.size());
    for (const JsonNode& record : records) {
        las.records.push_back(record_from(record));
    }
    return las;
}

}  // namespace knap
