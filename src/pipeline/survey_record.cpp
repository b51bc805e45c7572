#include "pipeline/survey_record.hpp"

#include <cstdint>
#include <string>
#include <system_error>

#include "base/scratch.hpp"
#include "pipeline/sources.hpp"

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
    for (const PositionFile& file : archive.positions) {
        positions.push_back(
            {file.path.filename().string(), file.source, file.first, file.count, file.bytes});
    }
    return {{"points", archive.table.points()},
            {"rejected", archive.table.rejected()},
            {"xxh3", digests},
            {"positions", positions}};
}

std::vector<PositionFile> recorded_positions(const Json& record, const fs::path& folder) {
    std::vector<PositionFile> positions;
    for (const Json& file : record.at("positions")) {
        positions.push_back({folder / file.at(0).get<std::string>(), file.at(1), file.at(2),
                             file.at(3), file.at(4)});
    }
    return positions;
}

void remove_positions(const fs::path& scratch) {
    std::vector<fs::path> left;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(scratch, ignored)) {
        if (entry.path().filename().string().find(".positions") != std::string::npos) {
            left.push_back(entry.path());
        }
    }
    for (const fs::path& file : left) {
        fs::remove(file, ignored);
    }
}

fs::path positions_folder(const std::vector<fs::path>& files, const fs::path& scratch) {
    // Brick files need more than positions do, and are checked against the disk once it is known
    // how many there are.
    const std::uint64_t bytes = position_bytes(source_infos(files));
    return 2 * bytes <= free_bytes(scratch) ? scratch : fs::path();
}

}  // namespace knap
