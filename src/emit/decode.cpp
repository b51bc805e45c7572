#include "emit/decode.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <functional>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "base/file.hpp"
#include "emit/draco_tile.hpp"
#include "emit/lattice.hpp"
#include "input/draco_reader.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "output/ply_writer.hpp"

namespace knap {

namespace fs = std::filesystem;

namespace {

/// Positions in blocks, each handed to `take`.
struct PositionBlocks {
    std::uint64_t points = 0;
    std::string crs;
    std::function<void(const std::function<void(std::span<const Vec3>)>& take)> for_each;
};

PositionBlocks archive_blocks(const fs::path& folder) {
    Archive archive(folder);
    PositionBlocks blocks;
    for (const ManifestTile& tile : archive.manifest().tiles) {
        blocks.points += tile.points;
    }
    blocks.crs = archive.manifest().crs;
    blocks.for_each = [archive = std::move(archive)](const auto& take) {
        for (std::size_t i = 0; i < archive.manifest().tiles.size(); ++i) {
            take(archive.read_tile(i));
        }
    };
    return blocks;
}

PositionBlocks draco_blocks(const fs::path& file) {
    const DracoCloud cloud = read_draco(file);
    std::vector<Vec3> positions;
    positions.reserve(cloud.positions.size());
    if (cloud.lattice) {
        const DecodedTile tile = on_lattice(cloud, file);
        for (const LatticeIndex& index : tile.points) {
            positions.push_back(position_of(tile.lattice, index));
        }
    } else {
        for (const std::array<float, 3>& position : cloud.positions) {
            positions.push_back({position[0], position[1], position[2]});
        }
    }
    PositionBlocks blocks;
    blocks.points = positions.size();
    blocks.crs = cloud.lattice ? cloud.lattice->crs : "";
    blocks.for_each = [positions = std::move(positions)](const auto& take) { take(positions); };
    return blocks;
}

DecodeResult write_ply(const PositionBlocks& blocks, const fs::path& output) {
    std::vector<std::string> comments{fmt::format("knap {}", KNAP_VERSION)};
    if (!blocks.crs.empty()) {
        comments.push_back(fmt::format("crs {}", blocks.crs));
    }
    PlyWriter writer(output, blocks.points, PlyWriter::Precision::kDouble, comments);
    blocks.for_each([&](std::span<const Vec3> positions) { writer.append(positions); });
    return {blocks.points, writer.finish()};
}

DecodeResult write_xyz(const PositionBlocks& blocks, const fs::path& output) {
    AtomicFile file(output);
    blocks.for_each([&](std::span<const Vec3> positions) {
        fmt::memory_buffer text;
        for (const Vec3& p : positions) {
            fmt::format_to(std::back_inserter(text), "{} {} {}\n", p.x, p.y, p.z);
            if (text.size() >= (std::size_t{1} << 20)) {
                file.write(std::string_view(text.data(), text.size()));
                text.clear();
            }
        }
        file.write(std::string_view(text.data(), text.size()));
    });
    file.commit();
    return {blocks.points, file.size()};
}

}  // namespace

DecodeResult decode(const fs::path& input, const fs::path& output, bool overwrite) {
    std::string ending = output.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (ending != ".ply" && ending != ".xyz") {
        throw ConfigError(fmt::format("{}: expected an output ending in .ply or .xyz, found \"{}\"",
                                      output.string(), ending));
    }
    std::error_code error;
    if (fs::is_directory(output, error)) {
        throw ConfigError(fmt::format("{}: expected a file, found a folder", output.string()));
    }
    if (fs::exists(fs::symlink_status(output, error)) && !overwrite) {
        throw ConfigError(fmt::format("{}: exists (needs --overwrite)", output.string()));
    }
    const PositionBlocks blocks =
        fs::is_directory(input, error) ? archive_blocks(input) : draco_blocks(input);
    return ending == ".ply" ? write_ply(blocks, output) : write_xyz(blocks, output);
}

}  // namespace knap
