#include "pipeline/brick_maker.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "input/stream.hpp"
#include "rank/brick_blocks.hpp"
#include "rank/rank_again.hpp"
#include "scatter/scatter.hpp"

namespace knap {

namespace {

constexpr std::uint64_t kRangePoints = std::uint64_t{1} << 20;
constexpr std::size_t kChunkPoints = std::size_t{1} << 16;

/// The distinct points of a part of a source.
CorePoints read_range(const SourceTable& table, const SourceRange& range) {
    BrickPoints read;
    const PointId first_id = table.sources()[range.source].first_id;
    stream_ranges(table.infos(), std::span(&range, 1), 1, kChunkPoints,
                  [&](std::size_t, std::size_t, const Chunk& chunk) {
                      PointId id = first_id + chunk.first;
                      for (const Vec3& p : chunk.positions) {
                          if (is_finite(p)) {
                              read.positions.push_back(p);
                              read.ids.push_back(id);
                          }
                          ++id;
                      }
                  });
    read.core_count = read.ids.size();
    return distinct_points(std::move(read));
}

}  // namespace

BrickMaker::BrickMaker(const SourceTable& table, const BrickPlan& plan,
                       const std::vector<BrickFile>& bricks, std::filesystem::path folder,
                       const CurvatureParams& curvature, bool frames, int threads, Note note)
    : table_(table),
      plan_(plan),
      bricks_(bricks),
      folder_(std::move(folder)),
      curvature_(curvature),
      frames_(frames),
      threads_(threads),
      note_(std::move(note)) {}

void BrickMaker::scatter(std::size_t brick, const std::string& why) {
    const std::scoped_lock lock(mutex_);
    scatter_one(brick, why);
}

std::vector<RankedPoint> BrickMaker::rank(std::size_t brick, double spacing,
                                          const std::string& why) {
    const std::scoped_lock lock(mutex_);
    scatter_one(brick, why);
    std::vector<RankedPoint> points =
        rank_again(table_, bricks_[brick], curvature_, frames_, spacing, sources());
    std::filesystem::remove(bricks_[brick].path);
    return points;
}

void BrickMaker::scatter_one(std::size_t brick, const std::string& why) const {
    note_(why + "; the brick is read from the sources again");
    scatter_again(table_, plan_, brick, folder_, threads_);
}

CoreAccess BrickMaker::sources() const {
    const auto ranges =
        std::make_shared<std::vector<SourceRange>>(cut_into_ranges(table_.infos(), kRangePoints));
    CoreAccess access;
    access.boxes.assign(ranges->size(), table_.box());
    access.load = [this, ranges](std::size_t part) { return read_range(table_, (*ranges)[part]); };
    return access;
}

}  // namespace knap
