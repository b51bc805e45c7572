#include "pipeline/merge_stage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "base/threads.hpp"
#include "merge/alpha_search.hpp"
#include "merge/range_law.hpp"

namespace knap {

namespace {

namespace fs = std::filesystem;

constexpr const char* kSelectionFile = "selection";

class Merging {
  public:
    Merging(const MergeStage& stage, const std::function<void(std::uint64_t)>& advance)
        : stage_(stage), advance_(advance) {}

    Merged run() {
        Merged merged;
        if (const auto* before = stage_.log.find("merge", kSelectionFile)) {
            advance_(stage_.ranked.points);
            merged.result = {Selection::load(file()), before->at("kept"),
                             before->at("represented")};
            merged.alpha = before->at("alpha");
        } else {
            merged = is_search() ? search() : merge_once();
            save(merged);
        }
        if (is_search()) {
            merged.runs = stage_.files.ranked_runs();
        } else {
            stage_.files.remove_undecided();
            merged.runs = stage_.files.kept_runs();
        }
        return merged;
    }

  private:
    bool is_search() const { return wanted_points(stage_.range, stage_.table.points()) > 0; }
    fs::path file() const { return stage_.scratch.path() / kSelectionFile; }

    Merged merge_once() {
        const RangeParams range = with_alpha(stage_.range, stage_.ranked.mean_curvature);
        MergeRequest request = request_for(range);
        request.on_settled = stage_.files.keeper();
        request.on_walked = stage_.files.walk_keeper();
        MergeResult result = merge(stage_.files.parts(), request, advance_);
        stage_.files.finish_walk();
        return {std::move(result), range.alpha, {}};
    }

    // The runs stay until the last attempt has settled it, and for emit.
    Merged search() {
        const RankResult& ranked = stage_.ranked;
        AlphaSearch search({.range = stage_.range,
                            .mean_curvature = ranked.mean_curvature,
                            .spacing = ranked.spacing,
                            .points = ranked.points,
                            .wanted = wanted_points(stage_.range, stage_.table.points())},
                           sample());
        for (std::size_t attempt = 0;; ++attempt) {
            const double alpha = search.next();
            const std::string name = number_name(attempt);
            if (const auto* before = stage_.log.find("attempt", name)) {
                search.told(before->at("kept"));
                continue;
            }
            RangeParams range = stage_.range;
            range.alpha = alpha;
            MergeRequest request = request_for(range);
            request.on_settled = stage_.files.attempt_keeper();
            MergeResult result =
                merge(stage_.files.parts(), request, [&](std::uint64_t) { advance_(0); });
            if (search.told(result.kept)) {
                advance_(ranked.points);
                return {std::move(result), alpha, {}};
            }
            stage_.log.record("attempt", name, {{"alpha", alpha}, {"kept", result.kept}});
        }
    }

    // Of the ranked points, those that the search looks at, in the method's order.
    std::vector<RankedPoint> sample() const {
        const SampleCells cells(stage_.ranked.points, stage_.ranked.spacing);
        std::vector<RankedPoint> sample;
        std::mutex mutex;
        parallel_tasks(stage_.ranked.bricks.size(), [&](std::size_t i) {
            std::vector<RankedPoint> some = stage_.files.ranked_points(i);
            std::erase_if(some, [&](const RankedPoint& p) { return !cells.contains(p.position); });
            advance_(0);
            const std::scoped_lock lock(mutex);
            sample.insert(sample.end(), some.begin(), some.end());
        });
        std::sort(sample.begin(), sample.end(),
                  [](const RankedPoint& a, const RankedPoint& b) { return ranks_before(a, b); });
        return sample;
    }

    MergeRequest request_for(const RangeParams& range) const {
        MergeRequest request;
        request.range = range;
        request.mean_curvature = stage_.ranked.mean_curvature;
        request.points = stage_.table.points();
        request.box = stage_.table.box();
        request.budget_bytes = stage_.budget_bytes;
        return request;
    }

    void save(const Merged& merged) {
        merged.result.selection.save(file());
        stage_.scratch.grew_by(static_cast<std::int64_t>(fs::file_size(file())));
        stage_.log.record("merge", kSelectionFile,
                          {{"kept", merged.result.kept},
                           {"represented", merged.result.represented},
                           {"alpha", merged.alpha}});
    }

    const MergeStage& stage_;
    const std::function<void(std::uint64_t)>& advance_;
};

}  // namespace

Merged merge_archive(const MergeStage& stage, const std::function<void(std::uint64_t)>& advance) {
    return Merging(stage, advance).run();
}

}  // namespace knap
