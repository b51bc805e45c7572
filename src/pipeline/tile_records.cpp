#include "pipeline/tile_records.hpp"

#include <string>

namespace knap {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kTile = "tile";

// JSON keeps doubles to the bit.
Json to_json(const Vec3& p) {
    return {p.x, p.y, p.z};
}

Vec3 vec_from(const Json& json) {
    return {json.at(0), json.at(1), json.at(2)};
}

}  // namespace

void record_tile(JobLog& log, std::size_t number, const ManifestTile& tile) {
    log.record(kTile, number_name(number),
               {{"file", tile.file},
                {"points", tile.points},
                {"min", to_json(tile.box.min)},
                {"max", to_json(tile.box.max)},
                {"origin", tile.origin},
                {"bytes", tile.bytes},
                {"xxh3", tile.xxh3}});
}

std::map<std::size_t, ManifestTile> read_tiles(const JobLog& log) {
    std::map<std::size_t, ManifestTile> tiles;
    for (const auto& [name, step] : log.all(kTile)) {
        const Json& json = *step;
        ManifestTile tile;
        tile.file = json.at("file");
        tile.points = json.at("points");
        tile.box = {vec_from(json.at("min")), vec_from(json.at("max"))};
        tile.origin = json.at("origin");
        tile.bytes = json.at("bytes");
        tile.xxh3 = json.at("xxh3");
        tiles[std::stoull(name)] = tile;
    }
    return tiles;
}

}  // namespace knap
