#include "pipeline/merge_stage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/threads.hpp"
#include "merge/alpha_search.hpp"
#include "merge/range_law.hpp"
#include "pipeline/repair.hpp"

namespace knap {

namespace {

namespace fs = std::filesystem;

class Merging {
  public:
    Merging(const MergeStage& stage, const std::function<void(std::uint64_t)>& advance)
        : stage_(stage), advance_(advance) {}

    Merged run() {
        Merged merged;
        if (const auto* before = stage_.log.find("merge", kMergedFile)) {
            advance_(stage_.ranked.points);
            merged.result = {Selection::load(file()), before->at("kept"),
                             before->at("represented")};
            merged.alpha = is_search() ? before->at("alpha").get<double>() : given_alpha();
        } else {
            merged = is_search() ? search() : merge_once();
            save(merged);
        }
        if (!repairs(stage_.range)) {
            tell_miss(stage_.range, stage_.table.points(), merged.result.kept, stage_.note);
        }
        if (runs_stay()) {
            stage_.files.remove_open();
            merged.runs = stage_.files.ranked_runs();
        } else {
            stage_.files.remove_undecided();
            merged.runs = stage_.files.kept_runs();
        }
        return merged;
    }

  private:
    double given_alpha() const {
        return with_alpha(stage_.range, stage_.ranked.mean_curvature).alpha;
    }
    std::uint64_t wanted() const {
        return wanted_before_repair(stage_.range,
                                    wanted_points(stage_.range, stage_.table.points()));
    }
    bool is_search() const { return wanted() > 0; }
    bool runs_stay() const {
        return is_search() || repairs(stage_.range) || !stage_.range.keep.empty();
    }
    fs::path file() const { return stage_.scratch.path() / kMergedFile; }

    Merged merge_once() {
        const RangeParams range = with_alpha(stage_.range, stage_.ranked.mean_curvature);
        MergeRequest request = request_for(range);
        if (runs_stay()) {
            request.on_settled = stage_.files.attempt_keeper();
            return {merge(stage_.files.parts(), request, advance_), range.alpha, 0, {}};
        }
        request.on_settled = stage_.files.keeper();
        request.on_walked = stage_.files.walk_keeper();
        MergeResult result = merge(stage_.files.parts(), request, advance_);
        stage_.files.finish_walk();
        return {std::move(result), range.alpha, 0, {}};
    }

    // The runs stay until the last attempt has settled it, and for emit.
    Merged search() {
        const RankResult& ranked = stage_.ranked;
        AlphaSearch search({.range = stage_.range,
                            .mean_curvature = ranked.mean_curvature,
                            .spacing = ranked.spacing,
                            .points = ranked.points,
                            .wanted = wanted()},
                           sample());
        Merged merged;
        for (std::size_t attempt = 0; !search.done(); ++attempt) {
            const std::string name = number_name(attempt);
            merged.alpha = search.next();
            if (const auto* before = stage_.log.find("attempt", name)) {
                search.told(before->at("alpha"), before->at("kept"));
                continue;
            }
            RangeParams range = stage_.range;
            range.alpha = merged.alpha;
            MergeRequest request = request_for(range);
            request.budget_bytes -= std::min(request.budget_bytes, search.memory_bytes());
            request.on_settled = stage_.files.attempt_keeper();
            merged.result =
                merge(stage_.files.parts(), request, [&](std::uint64_t) { advance_(0); });
            search.told(merged.alpha, merged.result.kept);
            if (!search.done()) {
                stage_.log.record("attempt", name,
                                  {{"alpha", merged.alpha}, {"kept", merged.result.kept}});
            }
        }
        advance_(ranked.points);
        return merged;
    }

    // Of the ranked points, those that the search looks at, in the method's order.
    std::vector<RankedPoint> sample() const {
        const SampleCells cells(stage_.ranked.points, stage_.ranked.spacing);
        std::vector<RankedPoint> sample;
        std::mutex mutex;
        parallel_tasks(stage_.ranked.bricks.size(), [&](std::size_t i) {
            const std::vector<RankedPoint> some = stage_.files.ranked_points(
                i, [&](const RankedPoint& p) { return cells.contains(p.position); });
            advance_(0);
            const std::scoped_lock lock(mutex);
            if (sample.size() <= cells.most_points()) {
                sample.insert(sample.end(), some.begin(), some.end());
            }
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
        nlohmann::ordered_json record{{"kept", merged.result.kept},
                                      {"represented", merged.result.represented}};
        if (is_search()) {
            record["alpha"] = merged.alpha;
        }
        stage_.log.record("merge", kMergedFile, record);
    }

    const MergeStage& stage_;
    const std::function<void(std::uint64_t)>& advance_;
};

}  // namespace

void tell_miss(const RangeParams& range, std::uint64_t points, std::uint64_t kept,
               const std::function<void(const std::string&)>& note) {
    const std::uint64_t wanted = wanted_points(range, points);
    const auto reached = static_cast<double>(kept);
    const auto asked = static_cast<double>(wanted);
    if (wanted > 0 && std::abs(reached - asked) > 0.01 * asked) {
        note(fmt::format("{} points were to be kept, {} are: no alpha comes nearer", wanted, kept));
    }
}

Merged merge_archive(const MergeStage& stage, const std::function<void(std::uint64_t)>& advance) {
    return Merging(stage, advance).run();
}

}  // namespace knap
