#include "pipeline/survey_record.hpp"

#include <cstdint>
#include <string>
#include <system_error>

namespace knap {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

}  // namespace

Json survey_record(const Survey& archive) {
    Json digests = Json::array();
    for (const SourceEntry& source : archive.table.sources()) {
        digests.push_back(source.xxh3);
    }
    // By name: the scratch folder may be moved.
    Json positions = Json::array();
    for (const PositionFile& file : archive.staged.files) {
        positions.push_back({file.path.filename().string(), file.source, file.first, file.count,
                             file.bytes, file.column_bytes});
    }
    return {{"points", archive.table.points()},
            {"rejected", archive.table.rejected()},
            {"xxh3", digests},
            {"positions", positions},
            {"columns", archive.staged.columns},
            {"stays", archive.staged.stays}};
}

StagedPoints recorded_points(const Json& record, const fs::path& folder) {
    StagedPoints staged;
    for (const Json& file : record.at("positions")) {
        staged.files.push_back({folder / file.at(0).get<std::string>(), file.at(1), file.at(2),
                                file.at(3), file.at(4), file.at(5)});
    }
    staged.columns = record.at("columns").get<std::vector<std::vector<std::size_t>>>();
    staged.stays = record.at("stays");
    return staged;
}

void remove_staged(const fs::path& scratch) {
    std::vector<fs::path> left;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(scratch, ignored)) {
        // A file that was being written has more of a name.
        const std::string name = entry.path().filename().string();
        if (name.find(".positions") != std::string::npos ||
            name.find(".columns") != std::string::npos) {
            left.push_back(entry.path());
        }
    }
    for (const fs::path& file : left) {
        fs::remove(file, ignored);
    }
}

}  // namespace knap
