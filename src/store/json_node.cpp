#include "store/json_node.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "knap/error.hpp"

namespace knap {

std::string dump_json(const Json& json, int indent) {
    return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

Json number_json(double value) {
    return std::isfinite(value) ? Json(value) : Json(fmt::format("{}", value));
}

Json triple_json(const Vec3& v) {
    return Json::array({number_json(v.x), number_json(v.y), number_json(v.z)});
}

Json box_json(const Box& box) {
    return {{"min", triple_json(box.min)}, {"max", triple_json(box.max)}};
}

JsonNode::JsonNode(const Json& json, std::string key, const std::filesystem::path& file)
    : json_(json), key_(std::move(key)), file_(file) {}

JsonNode JsonNode::at(std::string_view name) const {
    require(json_.is_object(), "an object");
    const auto found = json_.find(name);
    const std::string key = key_.empty() ? std::string(name) : fmt::format("{}.{}", key_, name);
    if (found == json_.end()) {
        throw InputError(fmt::format("{}: {}: expected a value, found none", file_.string(), key));
    }
    return {*found, key, file_};
}

bool JsonNode::has(std::string_view name) const {
    require(json_.is_object(), "an object");
    return json_.contains(name);
}

std::vector<std::string> JsonNode::keys() const {
    require(json_.is_object(), "an object");
    std::vector<std::string> keys;
    for (const auto& [name, value] : json_.items()) {
        keys.push_back(name);
    }
    return keys;
}

std::vector<JsonNode> JsonNode::items(std::optional<std::size_t> exactly) const {
    require(json_.is_array(), "an array");
    if (exactly && json_.size() != *exactly) {
        fail(fmt::format("{} values", *exactly), fmt::to_string(json_.size()));
    }
    std::vector<JsonNode> nodes;
    nodes.reserve(json_.size());
    for (std::size_t i = 0; i < json_.size(); ++i) {
        nodes.emplace_back(json_[i], fmt::format("{}[{}]", key_, i), file_);
    }
    return nodes;
}

std::string JsonNode::text() const {
    require(json_.is_string(), "a string");
    return json_.get<std::string>();
}

std::uint64_t JsonNode::count() const {
    require(json_.is_number_unsigned(), "a whole number >= 0");
    return json_.get<std::uint64_t>();
}

std::int64_t JsonNode::integer() const {
    const bool fits = json_.is_number_integer() &&
                      (!json_.is_number_unsigned() ||
                       json_.get<std::uint64_t>() <=
                           static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()));
    require(fits, "a whole number of 64 bits");
    return json_.get<std::int64_t>();
}

double JsonNode::number() const {
    if (json_ == "inf") {
        return std::numeric_limits<double>::infinity();
    }
    if (json_ == "-inf") {
        return -std::numeric_limits<double>::infinity();
    }
    require(json_.is_number(), "a number");
    return json_.get<double>();
}

bool JsonNode::is_nan() const {
    return json_ == "nan";
}

Vec3 JsonNode::triple() const {
    const std::vector<JsonNode> values = items(3);
    return {values[0].number(), values[1].number(), values[2].number()};
}

Box JsonNode::box() const {
    return {at("min").triple(), at("max").triple()};
}

void JsonNode::fail(std::string_view expected, std::string_view found) const {
    throw InputError(
        fmt::format("{}: {}: expected {}, found {}", file_.string(), key_, expected, found));
}

void JsonNode::require(bool holds, std::string_view expected) const {
    if (!holds) {
        fail(expected, json_.is_structured() ? json_.type_name() : dump_json(json_, -1));
    }
}

}  // namespace knap
