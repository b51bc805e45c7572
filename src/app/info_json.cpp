#include "app/info_json.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "input/draco_reader.hpp"
#include "store/attribute_json.hpp"
#include "store/json_node.hpp"
#include "store/las_json.hpp"
#include "store/manifest.hpp"
#include "store/tileset_file.hpp"

namespace knap::app {

namespace {

constexpr int kIndent = 2;

Json coordinates_json(const CoordinateFormat& format) {
    switch (format.kind) {
        case CoordinateKind::kFloat32:
            return {{"kind", "float32"}};
        case CoordinateKind::kInt32:
            return {{"kind", "int32"},
                    {"scale", triple_json(format.scale)},
                    {"offset", triple_json(format.offset)}};
        case CoordinateKind::kFloat64:
            break;
    }
    return {{"kind", "float64"}};
}

}  // namespace

std::string info_json(const SourceInfo& info) {
    Json json{{"kind", "source"},
              {"path", info.path.string()},
              {"format", info.format},
              {"bytes", info.size_bytes},
              {"points", info.declared_count ? Json(*info.declared_count) : Json()},
              {"coordinates", coordinates_json(info.coordinates)},
              {"attributes", attributes_json(info.schema)},
              {"crs", info.crs},
              {"unsupported", info.unsupported}};
    if (info.las) {
        json["las"] = las_json(*info.las);
    }
    return dump_json(json, kIndent) + "\n";
}

std::string info_json(const Archive& archive) {
    Json json{{"kind", "archive"},
              {"path", archive.folder().string()},
              {"manifest", Json::parse(format_manifest(archive.manifest()))}};
    if (const std::optional<TilesetIndex> tileset = find_tileset(archive.folder())) {
        json["tileset"] = {{"files", tileset->contents.size()},
                           {"points", tileset->points},
                           {"bytes", tileset->bytes()},
                           {"frame", tileset->frame}};
    }
    return dump_json(json, kIndent) + "\n";
}

std::string info_json_of_draco(const std::string& path) {
    const DracoCloud cloud = read_draco(path);
    Json json{{"kind", "draco"},
              {"path", path},
              {"format", cloud.lattice ? "Draco, written by knap" : "Draco"},
              {"bytes", std::filesystem::file_size(path)},
              {"points", cloud.positions.size()},
              {"attributes", attributes_json(cloud.columns.attributes)}};
    if (cloud.lattice) {
        json["lattice"] = {{"origin", triple_json(cloud.lattice->origin)},
                           {"step", number_json(cloud.lattice->step)}};
        json["crs"] = cloud.lattice->crs;
    }
    return dump_json(json, kIndent) + "\n";
}

}  // namespace knap::app
