#include "knap/simplify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "base/extent.hpp"
#include "base/threads.hpp"
#include "knap/error.hpp"
#include "merge/alpha_search.hpp"
#include "merge/merge.hpp"
#include "merge/range_law.hpp"
#include "merge/region.hpp"
#include "pipeline/repair.hpp"
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

MergeResult merge_all(std::vector<RankedPoint> order, const RangeParams& range,
                      const SimplifyResult& of, const Box& box) {
    std::vector<RankedPart> parts(1);
    parts[0].box = box;
    parts[0].points = order.size();
    parts[0].runs.push_back(std::make_unique<RunInMemory>(std::move(order)));
    MergeRequest request;
    request.range = range;
    request.mean_curvature = of.mean_curvature;
    request.points = of.counts.in;
    request.box = box;
    request.budget_bytes = kNoLimit;
    return merge(std::move(parts), request, [](std::uint64_t) {});
}

// Merges once, or until alpha is found.
MergeResult mark(const std::vector<RankedPoint>& order, const RangeParams& asked,
                 SimplifyResult& of, const Box& box) {
    RangeParams range = with_alpha(asked, of.mean_curvature);
    of.alpha = range.alpha;
    const std::uint64_t wanted = wanted_before_repair(asked, wanted_points(asked, of.counts.in));
    if (wanted == 0) {
        return merge_all(order, range, of, box);
    }
    std::vector<RankedPoint> sample;
    const SampleCells cells(order.size(), of.spacing);
    std::copy_if(order.begin(), order.end(), std::back_inserter(sample),
                 [&](const RankedPoint& p) { return cells.contains(p.position); });
    AlphaSearch search({.range = asked,
                        .mean_curvature = of.mean_curvature,
                        .spacing = of.spacing,
                        .points = order.size(),
                        .wanted = wanted},
                       std::move(sample));
    MergeResult merged;
    while (!search.done()) {
        range.alpha = of.alpha = search.next();
        merged = merge_all(order, range, of, box);
        search.told(of.alpha, merged.kept);
    }
    return merged;
}

/// The whole cloud as one part.
class RepairInMemory final : public RepairStore {
  public:
    RepairInMemory(const std::vector<RankedPoint>& order, const Box& box, Selection base)
        : order_(order), box_(box), base_(std::move(base)) {}

    std::size_t parts() const override { return 1; }
    Box box(std::size_t /*part*/) const override { return box_; }
    std::uint64_t points(std::size_t /*part*/) const override { return order_.size(); }
    std::vector<RankedPoint> read(std::size_t /*part*/,
                                  const std::function<bool(const RankedPoint&)>& wanted) override {
        std::vector<RankedPoint> points;
        std::copy_if(order_.begin(), order_.end(), std::back_inserter(points), wanted);
        return points;
    }
    void put(std::size_t /*part*/, Kind kind, std::vector<RankedPoint> points) override {
        runs_.at(kind) = std::move(points);
    }
    std::unique_ptr<RankedStream> stream(std::size_t /*part*/, Kind kind) override {
        return std::make_unique<RunInMemory>(runs_.at(kind));
    }
    Selection base() override { return base_; }
    void save(const RepairState& /*state*/) override {}
    std::optional<RepairState> saved() override { return std::nullopt; }
    void save_suspects(std::size_t /*part*/, const RepairState& /*state*/) override {}
    bool has_suspects(std::size_t /*part*/, const RepairState& /*state*/) override { return false; }

  private:
    const std::vector<RankedPoint>& order_;
    Box box_;
    Selection base_;
    std::array<std::vector<RankedPoint>, 3> runs_;
};

void add_to(MergeResult& merged, const std::vector<RankedPoint>& order, const RangeParams& asked,
            const SimplifyResult& of, const Box& box) {
    const std::uint64_t counted = merged.kept + merged.represented;
    const std::uint64_t wanted = wanted_points(asked, of.counts.in);
    RepairRequest request;
    request.range = asked;
    request.range.alpha = of.alpha;
    request.kept = merged.kept;
    request.wanted = wanted > 0 ? wanted : wanted_after_repair(asked, merged.kept);
    request.points = counted;
    request.ids = of.counts.in;
    request.box = box;
    request.budget_bytes = kNoLimit;
    request.note = [](const std::string&) {};
    RepairInMemory store(order, box, std::move(merged.selection));
    RepairState state = repair(store, request, [](std::uint64_t) {});
    merged.selection = std::move(state.selection);
    merged.kept = state.kept;
    merged.represented = counted - state.kept;
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
    if (!params.range.keep.empty()) {
        throw ConfigError(
            fmt::format("range.keep: expected none for points in memory, which have no attributes, "
                        "found \"{}\"",
                        params.range.keep));
    }
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
    const CurvatureEstimator estimator(params.curvature, result.spacing,
                                       needs_frames(params.range));
    std::vector<RankedPoint> order;
    order.reserve(brick.core_count);
    const RankedBrick ranked = rank_brick(brick, params.curvature.neighbours, estimator, box, box,
                                          [&](std::span<const RankedPoint> some) {
                                              order.insert(order.end(), some.begin(), some.end());
                                          });
    const std::uint64_t counted = ranked.points;
    result.mean_curvature =
        counted == 0 ? 0 : ranked.curvature_sum.value() / static_cast<double>(counted);

    MergeResult merged = mark(order, params.range, result, box);
    if (repairs(params.range)) {
        add_to(merged, order, params.range, result, box);
    }
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
