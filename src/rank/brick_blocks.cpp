#include "rank/brick_blocks.hpp"

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "knap/error.hpp"

namespace knap {

namespace {

// A file that lost whole blocks has no checksum that fails.
void check_count(const BrickFile& file, const char* part, std::uint64_t expected,
                 std::uint64_t found) {
    if (found != expected) {
        throw StorageError(
            fmt::format("{}: scratch file is damaged: expected {} {} points, found {}",
                        file.path.string(), expected, part, found));
    }
}

}  // namespace

PointBlocks block_brick(BrickPoints brick) {
    std::vector<TaggedPoint> points;
    points.reserve(brick.ids.size());
    for (std::size_t i = 0; i < brick.ids.size(); ++i) {
        points.emplace_back(brick.positions[i], brick.ids[i], i < brick.core_count);
    }
    brick = {};
    return make_blocks(std::move(points));
}

std::vector<TaggedPoint> load_points(const BrickFile& file, const SourceTable& table,
                                     bool with_halo) {
    std::vector<TaggedPoint> points;
    points.reserve(file.core_points + (with_halo ? file.halo_points : 0));
    std::uint64_t core = 0;
    stream_brick_file(file.path, table, with_halo, [&](PointId id, const Vec3& p, BrickPart part) {
        core += part == BrickPart::kCore ? 1 : 0;
        points.emplace_back(p, id, part == BrickPart::kCore);
    });
    check_count(file, "core", file.core_points, core);
    check_count(file, "halo", with_halo ? file.halo_points : 0, points.size() - core);
    return points;
}

PointBlocks load_brick(const BrickFile& file, const SourceTable& table, bool with_halo) {
    return make_blocks(load_points(file, table, with_halo));
}

CorePoints points_of(const PointBlocks& blocks) {
    CorePoints points{{}, blocks.ids};
    points.positions.reserve(blocks.size());
    for (std::size_t place = 0; place < blocks.size(); ++place) {
        points.positions.push_back(blocks.position(place));
    }
    return points;
}

CorePoints distinct_points(BrickPoints points) {
    return points_of(block_brick(std::move(points)));
}

}  // namespace knap
