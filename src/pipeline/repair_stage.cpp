#include "pipeline/repair_stage.hpp"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "merge/alpha_search.hpp"
#include "pipeline/repair.hpp"

namespace knap {

namespace {

namespace fs = std::filesystem;

constexpr const char* kStage = "repair";
constexpr const char* kParts = "suspects";

/// Bricks, and runs in the scratch folder.
class RepairFiles final : public RepairStore {
  public:
    explicit RepairFiles(const MergeStage& stage) : stage_(stage) {}

    std::size_t parts() const override { return bricks().size(); }
    Box box(std::size_t part) const override { return bricks()[part].box; }
    std::uint64_t points(std::size_t part) const override { return bricks()[part].points; }

    std::vector<RankedPoint> read(std::size_t part,
                                  const std::function<bool(const RankedPoint&)>& wanted) override {
        return stage_.files.ranked_points(part, wanted);
    }

    void put(std::size_t part, Kind kind, std::vector<RankedPoint> points) override {
        const fs::path path = path_of(part, kind);
        const std::int64_t before = size_of(path);
        const std::uint64_t bytes = write_run(
            path, stage_.table, points, kind == kOpen ? stage_.files.open_layout() : RunLayout{});
        stage_.scratch.grew_by(static_cast<std::int64_t>(bytes) - before);
    }

    std::unique_ptr<RankedStream> stream(std::size_t part, Kind kind) override {
        return std::make_unique<RunReader>(path_of(part, kind), stage_.table);
    }

    Selection base() override { return Selection::load(stage_.scratch.path() / kMergedFile); }

    // Two files in turn: the one that the log names stays until the next is named.
    void save(const RepairState& state) override {
        const std::string name = fmt::format("repaired.{}", saves_++ % 2);
        const fs::path path = stage_.scratch.path() / name;
        const std::int64_t before = size_of(path);
        state.selection.save(path);
        stage_.scratch.grew_by(size_of(path) - before);
        stage_.log.record(kStage, "",
                          {{"selection", name},
                           {"saves", saves_},
                           {"attempt", state.attempt},
                           {"pass", state.pass},
                           {"round", state.round},
                           {"limit", state.limit},
                           {"kept", state.kept},
                           {"violators", state.violators},
                           {"done", state.done}});
    }

    std::optional<RepairState> saved() override {
        const auto* record = stage_.log.find(kStage);
        if (record == nullptr) {
            return std::nullopt;
        }
        saves_ = record->at("saves");
        RepairState state{.attempt = record->at("attempt"),
                          .pass = record->at("pass"),
                          .round = record->at("round"),
                          .limit = record->at("limit"),
                          .kept = record->at("kept"),
                          .violators = record->at("violators"),
                          .done = record->at("done"),
                          .selection = Selection::load(stage_.scratch.path() /
                                                       record->at("selection").get<std::string>())};
        return state;
    }

    void save_suspects(std::size_t part, const RepairState& state) override {
        const std::scoped_lock lock(mutex_);
        stage_.log.record(kParts, number_name(part),
                          {{"attempt", state.attempt}, {"pass", state.pass}});
    }

    bool has_suspects(std::size_t part, const RepairState& state) override {
        const std::scoped_lock lock(mutex_);
        const auto* record = stage_.log.find(kParts, number_name(part));
        return record != nullptr && record->at("attempt") == state.attempt &&
               record->at("pass") == state.pass;
    }

    void remove_all() {
        for (std::size_t part = 0; part < parts(); ++part) {
            for (const Kind kind :
                 {RepairStore::kKept, RepairStore::kSuspects, RepairStore::kOpen}) {
                const fs::path path = path_of(part, kind);
                const std::int64_t bytes = size_of(path);
                std::error_code ignored;
                fs::remove(path, ignored);
                stage_.scratch.grew_by(-bytes);
            }
        }
    }

  private:
    const std::vector<RankedFiles>& bricks() const { return stage_.ranked.bricks; }

    fs::path path_of(std::size_t part, Kind kind) const {
        constexpr std::array kEndings{".copy", ".suspects", ".left"};
        return stage_.scratch.path() / (number_name(part) + kEndings.at(kind));
    }

    static std::int64_t size_of(const fs::path& path) {
        std::error_code absent;
        const std::uintmax_t bytes = fs::file_size(path, absent);
        return absent ? 0 : static_cast<std::int64_t>(bytes);
    }

    const MergeStage& stage_;
    std::mutex mutex_;
    std::uint64_t saves_ = 0;
};

}  // namespace

void repair_archive(const MergeStage& stage, Merged& merged,
                    const std::function<void(std::uint64_t)>& advance) {
    RepairFiles files(stage);
    const std::uint64_t points = stage.table.points();
    const std::uint64_t counted = merged.result.kept + merged.result.represented;
    const std::uint64_t asked = wanted_points(stage.range, points);
    RepairRequest request;
    request.range = stage.range;
    request.range.alpha = merged.alpha;
    request.kept = merged.result.kept;
    request.wanted = asked > 0 ? asked : wanted_after_repair(stage.range, merged.result.kept);
    request.points = counted;
    request.ids = points;
    request.box = stage.table.box();
    request.budget_bytes = stage.budget_bytes;
    request.note = stage.note;
    merged.result.selection = Selection();
    RepairState state = repair(files, request, advance);
    files.remove_all();
    merged.result.selection = std::move(state.selection);
    merged.result.selection.finish();
    merged.result.kept = state.kept;
    merged.result.represented = counted - state.kept;
    tell_miss(stage.range, points, state.kept, stage.note);
}

}  // namespace knap
