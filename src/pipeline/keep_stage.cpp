#include "pipeline/keep_stage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <nlohmann/json.hpp>
#include <span>
#include <tuple>
#include <utility>

#include "base/file.hpp"
#include "base/threads.hpp"
#include "keep/keep.hpp"
#include "knap/error.hpp"
#include "pipeline/sources.hpp"

namespace knap {

namespace {

namespace fs = std::filesystem;

constexpr const char* kStage = "keep";

bool is_before(const Vec3& a, const Vec3& b) {
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

/// Finds the points and adds them.
class Protecting {
  public:
    Protecting(const MergeStage& stage, const StagedPoints& staged, int threads, Merged& merged,
               const std::function<void(std::uint64_t)>& advance)
        : stage_(stage), staged_(staged), threads_(threads), merged_(merged), advance_(advance) {}

    void run() {
        const std::uint64_t kept = merged_.result.selection.count();
        ranked_ = Selection(stage_.table.points());
        for_each_ranked([&](const RankedPoint& point) { ranked_.set(point.id); });
        const KeepExpression expression(stage_.range.keep);
        find_held(
            expression, stage_.table, staged_, stage_.note, threads_,
            [&](const HeldPoints& held) { take(held); }, advance_);
        add_where_merged();
        merged_.result.selection.finish();
        merged_.protected_points = merged_.result.selection.count() - kept;
    }

  private:
    // A point that is in no run is one of several in a place, of which the first stands for all.
    void take(const HeldPoints& held) {
        for (std::size_t i = 0; i < held.ids.size(); ++i) {
            if (ranked_.test(held.ids[i])) {
                merged_.result.selection.set(held.ids[i]);
            } else {
                places_.push_back(held.positions[i]);
            }
        }
        if (places_.size() * sizeof(Vec3) > stage_.budget_bytes) {
            throw StorageError(
                fmt::format("resources.memory: range.keep holds for more than {} points that lie "
                            "where others do, expected them to fit {}",
                            places_.size(), format_bytes(stage_.budget_bytes)));
        }
    }

    void add_where_merged() {
        if (places_.empty()) {
            return;
        }
        std::sort(places_.begin(), places_.end(), is_before);
        for_each_ranked([&](const RankedPoint& point) {
            if (std::binary_search(places_.begin(), places_.end(), point.position, is_before)) {
                merged_.result.selection.set(point.id);
            }
        });
    }

    void for_each_ranked(const std::function<void(const RankedPoint&)>& visit) {
        std::mutex mutex;
        parallel_tasks(stage_.ranked.bricks.size(), [&](std::size_t brick) {
            MergeFiles::TakeRanked take = [&](std::span<const RankedPoint> points) {
                const std::scoped_lock lock(mutex);
                std::for_each(points.begin(), points.end(), visit);
            };
            stage_.files.read_ranked(brick, [&] { return take; });
        });
    }

    const MergeStage& stage_;
    const StagedPoints& staged_;
    int threads_;
    Merged& merged_;
    const std::function<void(std::uint64_t)>& advance_;
    Selection ranked_;
    std::vector<Vec3> places_;
};

}  // namespace

void check_keep(const Job& job, const std::vector<fs::path>& files) {
    if (!job.range.keep.empty()) {
        check_keep(KeepExpression(job.range.keep), source_infos(files));
    }
}

void protect_points(const MergeStage& stage, const StagedPoints& staged, int threads,
                    Merged& merged, const std::function<void(std::uint64_t)>& advance) {
    const fs::path file = stage.scratch.path() / kProtectedFile;
    const std::uint64_t counted = merged.result.kept + merged.result.represented;
    if (const auto* before = stage.log.find(kStage, kProtectedFile)) {
        merged.result.selection = Selection::load(file);
        merged.protected_points = before->at("protected");
        advance(stage.table.points());
    } else {
        Protecting(stage, staged, threads, merged, advance).run();
        merged.result.selection.save(file);
        stage.scratch.grew_by(static_cast<std::int64_t>(fs::file_size(file)));
        stage.log.record(kStage, kProtectedFile, {{"protected", merged.protected_points}});
    }
    merged.result.kept = merged.result.selection.count();
    merged.result.represented = counted - merged.result.kept;
}

}  // namespace knap
