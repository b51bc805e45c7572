#include "store/manifest.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "base/checksum.hpp"
#include "base/file.hpp"
#include "knap/error.hpp"
#include "store/attribute_json.hpp"
#include "store/json_node.hpp"
#include "store/las_json.hpp"

namespace knap {

namespace {

constexpr std::string_view kFormat = "knap archive";

constexpr std::array<std::pair<CoordinateKind, std::string_view>, 3> kCoordinateKinds{
    {{CoordinateKind::kFloat32, "float32"},
     {CoordinateKind::kInt32, "int32"},
     {CoordinateKind::kFloat64, "float64"}}};

std::string checksum_of(const Json& without_checksum) {
    const std::string text = dump_json(without_checksum, -1);
    return fmt::format("{:016x}", xxh3_64(std::as_bytes(std::span(text.data(), text.size()))));
}

Json source_json(const ManifestSource& source) {
    std::string_view kind;
    for (const auto& [value, name] : kCoordinateKinds) {
        if (value == source.coordinates.kind) {
            kind = name;
        }
    }
    Json schema = Json::array();
    for (const Attribute& attribute : source.schema) {
        schema.push_back(attribute_json(attribute));
    }
    Json json{{"path", source.path},
              {"format", source.format},
              {"points", source.points},
              {"rejected", source.rejected},
              {"bytes", source.bytes},
              {"xxh3", source.xxh3},
              {"coordinates",
               {{"kind", kind},
                {"scale", triple_json(source.coordinates.scale)},
                {"offset", triple_json(source.coordinates.offset)}}},
              {"schema", schema},
              {"crs", source.crs}};
    if (source.las) {
        json["las"] = las_json(*source.las);
    }
    return json;
}

Json tile_json(const ManifestTile& tile) {
    return {
        {"file", tile.file},         {"points", tile.points},
        {"box", box_json(tile.box)}, {"origin", {tile.origin[0], tile.origin[1], tile.origin[2]}},
        {"bytes", tile.bytes},       {"xxh3", tile.xxh3}};
}

CoordinateKind coordinate_kind(const JsonNode& node) {
    for (const auto& [value, name] : kCoordinateKinds) {
        if (node.text() == name) {
            return value;
        }
    }
    node.fail("float32, int32 or float64", node.text());
}

// A manifest may come from anywhere; no name in it may lead out of the archive.
std::string tile_file(const JsonNode& node) {
    const std::filesystem::path path = node.text();
    const bool inside = path.parent_path() == "tiles" && path.filename() != ".." &&
                        path.filename() != "." && path.has_filename();
    if (!inside) {
        node.fail("a file in tiles/", node.text());
    }
    return node.text();
}

ManifestSource source_from(const JsonNode& node) {
    ManifestSource source;
    source.path = node.at("path").text();
    source.format = node.at("format").text();
    source.points = node.at("points").count();
    source.rejected = node.at("rejected").count();
    source.bytes = node.at("bytes").count();
    source.xxh3 = node.at("xxh3").text();
    const JsonNode coordinates = node.at("coordinates");
    source.coordinates = {coordinate_kind(coordinates.at("kind")), coordinates.at("scale").triple(),
                          coordinates.at("offset").triple()};
    for (const JsonNode& attribute : node.at("schema").items()) {
        source.schema.push_back(attribute_from(attribute));
    }
    source.crs = node.at("crs").text();
    if (node.has("las")) {
        source.las = las_from(node.at("las"));
    }
    return source;
}

ManifestTile tile_from(const JsonNode& node) {
    ManifestTile tile;
    tile.file = tile_file(node.at("file"));
    tile.points = node.at("points").count();
    tile.box = node.at("box").box();
    const std::vector<JsonNode> origin = node.at("origin").items(3);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        tile.origin[axis] = origin[axis].integer();
    }
    tile.bytes = node.at("bytes").count();
    tile.xxh3 = node.at("xxh3").text();
    return tile;
}

Counts counts_from(const JsonNode& node) {
    return {.in = node.at("in").count(),
            .kept = node.at("kept").count(),
            .represented = node.at("represented").count(),
            .merged = node.at("merged").count(),
            .rejected = node.at("rejected").count()};
}

Lattice lattice_from(const JsonNode& node) {
    const Lattice lattice{node.at("origin").triple(), node.at("step").number()};
    if (!(lattice.step > 0) || !std::isfinite(lattice.step)) {
        node.at("step").fail("a finite number > 0", fmt::to_string(lattice.step));
    }
    return lattice;
}

}  // namespace

std::string format_manifest(const Manifest& manifest) {
    Json parameters = Json::object();
    for (const auto& [key, value] : manifest.parameters) {
        parameters[key] = value;
    }
    Json sources = Json::array();
    for (const ManifestSource& source : manifest.sources) {
        sources.push_back(source_json(source));
    }
    Json attributes = Json::array();
    for (const Attribute& attribute : manifest.attributes) {
        attributes.push_back(attribute_json(attribute));
    }
    Json tiles = Json::array();
    for (const ManifestTile& tile : manifest.tiles) {
        tiles.push_back(tile_json(tile));
    }
    const Counts& counts = manifest.counts;
    Json json{{"format", kFormat},
              {"format_version", manifest.format_version},
              {"knap_version", manifest.knap_version},
              {"parameters", parameters},
              {"sources", sources},
              {"counts",
               {{"in", counts.in},
                {"kept", counts.kept},
                {"represented", counts.represented},
                {"merged", counts.merged},
                {"rejected", counts.rejected}}},
              {"spacing", number_json(manifest.spacing)},
              {"mean_curvature", number_json(manifest.mean_curvature)},
              {"lattice",
               {{"origin", triple_json(manifest.lattice.origin)},
                {"step", number_json(manifest.lattice.step)}}},
              {"box", box_json(manifest.box)},
              {"crs", manifest.crs},
              {"attributes", attributes},
              {"tiles", tiles}};
    json["xxh3"] = checksum_of(json);
    return dump_json(json, 2) + "\n";
}

Manifest parse_manifest(std::string_view text, const std::filesystem::path& file) {
    Json json = Json::parse(text, nullptr, false);
    const bool is_manifest = json.is_object() && json.value("format", Json()) == kFormat;
    if (!is_manifest) {
        throw InputError(fmt::format("{}: expected the JSON of a knap archive, found {}",
                                     file.string(),
                                     json.is_discarded() ? "no JSON" : "other JSON"));
    }
    const JsonNode root(json, "", file);
    Manifest manifest;
    const std::uint64_t version = root.at("format_version").count();
    if (version < 1 || version > static_cast<std::uint64_t>(kArchiveFormatVersion)) {
        root.at("format_version")
            .fail(fmt::format("at most {}", kArchiveFormatVersion), fmt::to_string(version));
    }
    const std::string checksum = root.at("xxh3").text();
    Json body = json;
    body.erase("xxh3");
    if (checksum_of(body) != checksum) {
        root.at("xxh3").fail(checksum_of(body), checksum);
    }

    manifest.format_version = static_cast<int>(version);
    manifest.knap_version = root.at("knap_version").text();
    const JsonNode parameters = root.at("parameters");
    for (const std::string& key : parameters.keys()) {
        manifest.parameters.emplace_back(key, parameters.at(key).text());
    }
    for (const JsonNode& source : root.at("sources").items()) {
        manifest.sources.push_back(source_from(source));
    }
    manifest.counts = counts_from(root.at("counts"));
    manifest.spacing = root.at("spacing").number();
    manifest.mean_curvature = root.at("mean_curvature").number();
    manifest.lattice = lattice_from(root.at("lattice"));
    manifest.box = root.at("box").box();
    manifest.crs = root.at("crs").text();
    if (root.has("attributes")) {  // archives of 0.1.0 carry none
        for (const JsonNode& attribute : root.at("attributes").items()) {
            manifest.attributes.push_back(attribute_from(attribute));
        }
    }
    for (const JsonNode& tile : root.at("tiles").items()) {
        manifest.tiles.push_back(tile_from(tile));
    }
    return manifest;
}

Manifest read_manifest(const std::filesystem::path& folder) {
    const std::filesystem::path file = folder / kManifestName;
    if (std::filesystem::is_directory(folder) && !std::filesystem::exists(file)) {
        throw InputError(fmt::format("{}: expected an archive, found a folder without {}",
                                     folder.string(), kManifestName));
    }
    return parse_manifest(read_text_file(file), file);
}

void write_manifest(const std::filesystem::path& folder, const Manifest& manifest) {
    write_text_file(folder / kManifestName, format_manifest(manifest));
}

}  // namespace knap
