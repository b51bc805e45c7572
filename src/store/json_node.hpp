#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "knap/geometry.hpp"

namespace knap {

using Json = nlohmann::ordered_json;

/// JSON text. File names and CRS texts need not be UTF-8, JSON must be: what is not is replaced.
/// @param indent  spaces a level; -1: all on one line
std::string dump_json(const Json& json, int indent);

/// A double as JSON: it reads back the same; what is not finite becomes "inf", "-inf" or "nan".
Json number_json(double value);
Json triple_json(const Vec3& v);
Json box_json(const Box& box);

/// A value of a JSON file that knows where it stands, so that every error can say so. Refers to
/// the JSON and the path it is made from.
///
/// All readers throw InputError naming file, key, what was expected and what was found.
class JsonNode {
  public:
    JsonNode(const Json& json, std::string key, const std::filesystem::path& file);

    /// The member of an object.
    JsonNode at(std::string_view name) const;
    /// Does the object have this member?
    bool has(std::string_view name) const;
    /// Keys of an object, in order.
    std::vector<std::string> keys() const;
    /// The items of an array.
    /// @param exactly  how many there must be
    std::vector<JsonNode> items(std::optional<std::size_t> exactly = std::nullopt) const;

    std::string text() const;
    std::uint64_t count() const;
    std::int64_t integer() const;
    double number() const;
    /// True for number_json() of what is no number, which number() refuses.
    bool is_nan() const;
    Vec3 triple() const;
    Box box() const;

    [[noreturn]] void fail(std::string_view expected, std::string_view found) const;

  private:
    void require(bool holds, std::string_view expected) const;

    const Json& json_;
    std::string key_;
    const std::filesystem::path& file_;
};

}  // namespace knap
