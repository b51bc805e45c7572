#include "knap/simplify.hpp"

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>

#include "base/extent.hpp"
#include "base/threads.hpp"
#include "merge/merge.hpp"
#include "plan/plan.hpp"
#include "rank/curvature_pass.hpp"
#include "rank/spacing.hpp"
#include "store/occupancy.hpp"

namespace knap {

namespace {

constexpr std::uint64_t kGridBytes = std::uint64_t{64} << 20;
constexpr double kFirstVoxels = 512;
constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

// All finite points as one brick.
BrickPoints whole_cloud(std::span<const Vec3> points, Box& box) {
    BrickPoints brick;
    brick.positions.reserve(points.size());
    brick.ids.reserve(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (is_finite(points[i])) {
            box.extend(points[i]);
            brick.positions.push_back(points[i]);
            brick.ids.push_back(i);
        }
    }
    brick.core_count = brick.ids.size();
    return brick;
}

double order_voxel(const BrickPoints& cloud, const Box& box) {
    const Vec3 size = box.size();
    const double longest = std::max({size.x, size.y, size.z});
    if (!(longest > 0)) {
        return 1;
    }
    Occupancy occupancy(longest / kFirstVoxels, kGridBytes);
    for (const Vec3& p : cloud.positions) {
        occupancy.add(p);
    }
    const PlanRequest one_brick{
        .neighbours = 1, .target_points = kNoLimit, .most_points = kNoLimit};
    return plan_bricks(occupancy, box, one_brick).bricks.front().order_voxel;
}

}  // namespace

SimplifyResult simplify(std::span<const Vec3> points, const SimplifyParams& params) {
    Job job;
    job.input = {"points in memory"};
    job.output.path = "memory";
    job.curvature = params.curvature;
    job.range = params.range;
    job.resources.threads = params.threads;
    validate(job);
    const ThreadLimit limit(thread_count(params.threads));

    SimplifyResult result;
    Box box;
    BrickPoints cloud = whole_cloud(points, box);
    check_extent(box);
    result.counts.in = points.size();
    result.counts.rejected = points.size() - cloud.ids.size();

    const double voxel = order_voxel(cloud, box);
    const SpacingSample sample(cloud.ids.size());
    const BrickSpacing spacing = brick_spacing(cloud, sample, box, box, voxel);
    result.spacing =
        spacing.count == 0 ? 0 : spacing.sum.value() / static_cast<double>(spacing.count);

    OrderedBrick brick = order_brick(std::move(cloud), voxel);
    result.counts.merged = brick.merged;
    const FourierEstimator estimator(params.curvature, result.spacing);
    RankedBrick ranked =
        rank_brick(std::move(brick), params.curvature.neighbours, estimator, box, box);
    const std::uint64_t counted = ranked.points.size();
    result.mean_curvature =
        counted == 0 ? 0 : ranked.curvature_sum.value() / static_cast<double>(counted);

    std::vector<RankedPart> parts(1);
    parts[0].box = box;
    parts[0].points = counted;
    parts[0].runs.push_back(std::make_unique<RunInMemory>(std::move(ranked.points)));
    const MergeResult merged = merge(std::move(parts),
                                     {.range = params.range,
                                      .mean_curvature = result.mean_curvature,
                                      .points = points.size(),
                                      .box = box,
                                      .budget_bytes = kNoLimit},
                                     [](std::uint64_t) {});
    result.counts.kept = merged.kept;
    result.counts.represented = merged.represented;
    result.kept.reserve(merged.kept);
    for (PointId id = 0; id < points.size(); ++id) {
        if (merged.selection.test(id)) {
            result.kept.push_back(id);
        }
    }
    return result;
}

}  // namespace knap
