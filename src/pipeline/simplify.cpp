#include "knap/simplify.hpp"

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>

#include "base/extent.hpp"
#include "base/threads.hpp"
#include "merge/merge.hpp"
#include "rank/brick_blocks.hpp"
#include "rank/curvature_pass.hpp"
#include "rank/spacing.hpp"

namespace knap {

namespace {

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

    const SpacingSample sample(cloud.ids.size());
    const PointBlocks brick = block_brick(std::move(cloud));
    const BrickSpacing spacing = brick_spacing(brick, sample, box, box);
    result.spacing =
        spacing.count == 0 ? 0 : spacing.sum.value() / static_cast<double>(spacing.count);

    result.counts.merged = brick.merged;
    const CurvatureEstimator estimator(params.curvature, result.spacing);
    std::vector<RankedPoint> order;
    order.reserve(brick.core_count);
    const RankedBrick ranked = rank_brick(brick, params.curvature.neighbours, estimator, box, box,
                                          [&](std::span<const RankedPoint> some) {
                                              order.insert(order.end(), some.begin(), some.end());
                                          });
    const std::uint64_t counted = ranked.points;
    result.mean_curvature =
        counted == 0 ? 0 : ranked.curvature_sum.value() / static_cast<double>(counted);

    std::vector<RankedPart> parts(1);
    parts[0].box = box;
    parts[0].points = counted;
    parts[0].runs.push_back(std::make_unique<RunInMemory>(std::move(order)));
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
