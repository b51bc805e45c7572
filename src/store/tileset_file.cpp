#include "store/tileset_file.hpp"

#include <fmt/format.h>

#include <span>
#include <system_error>

#include "base/checksum.hpp"
#include "base/file.hpp"
#include "knap/error.hpp"
#include "store/attribute_json.hpp"
#include "store/json_node.hpp"

namespace knap {

namespace {

constexpr int kVersion = 1;
constexpr const char* kDraco = "3DTILES_draco_point_compression";

std::string checksum_of(const Json& without_checksum) {
    const std::string text = dump_json(without_checksum, -1);
    return fmt::format("{:016x}", xxh3_64(std::as_bytes(std::span(text.data(), text.size()))));
}

/// Middle, then half of each side as a vector.
Json volume_json(const Box& box) {
    const Vec3 size = box.size();
    const Vec3 middle = box.min + Vec3{size.x / 2, size.y / 2, size.z / 2};
    return {{"box",
             {middle.x, middle.y, middle.z, size.x / 2, 0, 0, 0, size.y / 2, 0, 0, 0, size.z / 2}}};
}

Json content_json(const TilesetContent& content) {
    return {
        {"uri", content.file},
        {"extras", {{"points", content.points}, {"bytes", content.bytes}, {"xxh3", content.xxh3}}}};
}

Json node_json(const Tileset& tileset, std::size_t number) {
    const TilesetNode& node = tileset.nodes[number];
    Json json{{"boundingVolume", volume_json(node.box)},
              {"geometricError", node.geometric_error},
              {"refine", "ADD"},
              {"transform", node.transform}};
    if (!node.content.file.empty()) {
        json["content"] = content_json(node.content);
    }
    if (!node.children.empty()) {
        Json children = Json::array();
        for (const std::size_t child : node.children) {
            children.push_back(node_json(tileset, child));
        }
        json["children"] = children;
    }
    return json;
}

Json knap_json(const Tileset& tileset) {
    return {{"format_version", kVersion},
            {"knap_version", tileset.knap_version},
            {"archive", tileset.archive},
            {"points", tileset.points},
            {"frame", tileset.frame},
            {"crs", tileset.crs},
            {"operation", tileset.operation},
            {"largest_error", number_json(tileset.largest_error)},
            {"attributes", attributes_json(tileset.attributes)}};
}

TilesetContent content_from(const JsonNode& node) {
    TilesetContent content;
    content.file = node.at("uri").text();
    const std::filesystem::path path = content.file;
    if (path.filename() != path || path.extension() != ".pnts") {
        node.at("uri").fail("a .pnts file in the same folder", content.file);
    }
    content.points = node.at("extras").at("points").count();
    content.bytes = node.at("extras").at("bytes").count();
    content.xxh3 = node.at("extras").at("xxh3").text();
    return content;
}

void collect(const JsonNode& node, std::vector<TilesetContent>& contents) {
    if (node.has("content")) {
        contents.push_back(content_from(node.at("content")));
    }
    if (node.has("children")) {
        for (const JsonNode& child : node.at("children").items()) {
            collect(child, contents);
        }
    }
}

}  // namespace

std::string format_tileset(const Tileset& tileset) {
    Json json{{"asset", {{"version", "1.0"}}}};
    Json root{{"boundingVolume", volume_json({{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}})},
              {"geometricError", 0},
              {"refine", "ADD"}};
    if (!tileset.nodes.empty()) {
        json["extensionsUsed"] = {kDraco};
        json["extensionsRequired"] = {kDraco};
        root = node_json(tileset, 0);
    }
    json["geometricError"] = tileset.geometric_error;
    json["root"] = root;
    json["extras"] = {{"knap", knap_json(tileset)}};
    json["extras"]["knap"]["xxh3"] = checksum_of(json);
    return dump_json(json, 1) + "\n";
}

TilesetIndex read_tileset_index(const std::filesystem::path& folder) {
    const std::filesystem::path file = folder / kTilesetName;
    Json json = Json::parse(read_text_file(file), nullptr, false);
    if (!json.is_object()) {
        throw InputError(fmt::format("{}: expected the JSON of a tileset, found {}", file.string(),
                                     json.is_discarded() ? "no JSON" : "other JSON"));
    }
    const JsonNode root(json, "", file);
    const JsonNode knap = root.at("extras").at("knap");
    const std::uint64_t version = knap.at("format_version").count();
    if (version != kVersion) {
        knap.at("format_version").fail(fmt::to_string(kVersion), fmt::to_string(version));
    }
    const std::string checksum = knap.at("xxh3").text();
    Json body = json;
    body["extras"]["knap"].erase("xxh3");
    if (checksum_of(body) != checksum) {
        knap.at("xxh3").fail(checksum_of(body), checksum);
    }
    TilesetIndex index;
    index.archive = knap.at("archive").text();
    index.points = knap.at("points").count();
    index.frame = knap.at("frame").text();
    collect(root.at("root"), index.contents);
    return index;
}

std::optional<TilesetIndex> find_tileset(const std::filesystem::path& archive) {
    const std::filesystem::path folder = archive / kTilesetFolder;
    std::error_code ignored;
    if (!std::filesystem::exists(std::filesystem::symlink_status(folder, ignored))) {
        return std::nullopt;
    }
    return read_tileset_index(folder);
}

std::uint64_t TilesetIndex::bytes() const {
    std::uint64_t sum = 0;
    for (const TilesetContent& content : contents) {
        sum += content.bytes;
    }
    return sum;
}

}  // namespace knap
