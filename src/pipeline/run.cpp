#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>

#include "base/checksum.hpp"
#include "base/scratch.hpp"
#include "base/threads.hpp"
#include "emit/output_check.hpp"
#include "emit/output_folder.hpp"
#include "knap/error.hpp"
#include "knap/job.hpp"
#include "merge/region.hpp"
#include "pipeline/brick_maker.hpp"
#include "pipeline/emit_stage.hpp"
#include "pipeline/forecast.hpp"
#include "pipeline/identity.hpp"
#include "pipeline/job_log.hpp"
#include "pipeline/keep_stage.hpp"
#include "pipeline/merge_stage.hpp"
#include "pipeline/rank_log.hpp"
#include "pipeline/repair.hpp"
#include "pipeline/repair_stage.hpp"
#include "pipeline/report_stage.hpp"
#include "pipeline/sources.hpp"
#include "pipeline/stage_clock.hpp"
#include "pipeline/staging.hpp"
#include "pipeline/survey_record.hpp"
#include "plan/plan.hpp"
#include "rank/rank.hpp"
#include "scatter/scatter.hpp"
#include "store/brick_map.hpp"
#include "store/checkpoint.hpp"
#include "survey/survey.hpp"

namespace knap {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kJournal = "journal";
constexpr const char* kSurveyFile = "survey";
constexpr const char* kPlanFile = "plan";
constexpr const char* kScatterFile = "scatter";

/// The stages of one job, each a value from the value before. What they leave on disk is named in
/// the journal before the next one needs it, and what the journal names is not made again.
class Pipeline {
  public:
    Pipeline(const Job& job, const std::vector<fs::path>& files, Progress& progress)
        : job_(job),
          files_(files),
          threads_(thread_count(job.resources.threads)),
          limit_(threads_),
          budgets_(share_memory(job.resources.memory_bytes)),
          scratch_(scratch_parent(job) / scratch_name(job)),
          log_(scratch_.path() / kJournal),
          progress_(progress),
          clock_(progress) {}

    Report run() {
        take_up();
        try {
            const Scattered bricks = cut();
            BrickMaker maker(bricks.table, bricks.plan, bricks.files, scratch_.path(),
                             job_.curvature, needs_frames(job_.range), threads_,
                             [&](const std::string& note) { clock_.note(note); });
            const RankResult ranked = rank_all(bricks.table, bricks.files, maker);
            MergeFiles files(scratch_, log_, bricks.table, budgets_.stage, needs_frames(job_.range),
                             ranked.bricks, [&](std::size_t brick, const std::string& why) {
                                 return maker.rank(brick, ranked.spacing, why);
                             });
            ReportStage pictures(bricks.table, ranked, files, scratch_, log_);
            if (job_.output.report) {
                clock_.time("draw", 2 * ranked.points, [&](const auto& advance) {
                    pictures.draw_all(advance);
                    return true;
                });
            }
            const MergeStage stage{.range = job_.range,
                                   .table = bricks.table,
                                   .ranked = ranked,
                                   .files = files,
                                   .scratch = scratch_,
                                   .log = log_,
                                   .budget_bytes = beside_selection(bricks.table),
                                   .note = [&](const std::string& note) { clock_.note(note); }};
            Merged merged = clock_.time("merge", ranked.points, [&](const auto& advance) {
                return merge_archive(stage, advance);
            });
            if (repairs(job_.range)) {
                clock_.time("repair", ranked.points, [&](const auto& advance) {
                    repair_archive(stage, merged, advance);
                    return merged.result.kept;
                });
            }
            if (!job_.range.keep.empty()) {
                clock_.time("keep", bricks.table.points(), [&](const auto& advance) {
                    protect_points(stage, bricks.staged, threads_, merged, advance);
                    return merged.result.kept;
                });
            }
            Report report = emit_output({.job = job_,
                                         .table = bricks.table,
                                         .ranked = ranked,
                                         .merged = merged,
                                         .staged = bricks.staged,
                                         .scratch = scratch_,
                                         .log = log_,
                                         .clock = clock_,
                                         .memory_bytes = beside_selection(bricks.table),
                                         .threads = threads_,
                                         .report = job_.output.report ? &pictures : nullptr});
            scratch_.keep(false);
            return report;
        } catch (const ConfigError&) {
            throw_away();
            throw;
        } catch (const InputError&) {
            throw_away();
            throw;
        } catch (const Interrupted& error) {
            throw Interrupted(error.what() + what_is_kept());
        } catch (const StorageError& error) {
            throw StorageError(error.what() + what_is_kept());
        }
    }

  private:
    struct Scattered {
        SourceTable table;
        BrickPlan plan;
        std::vector<BrickFile> files;
        StagedPoints staged;  ///< that stays
    };

    // Goes on with what an earlier run left, if that was the same job.
    void take_up() {
        const Json identity = identity_of(job_, files_);
        if (log_.is_damaged() && !job_.restart) {
            scratch_.keep(true);
            throw StorageError(
                fmt::format("{}: scratch file is damaged: expected lines that match their "
                            "checksums; --restart begins anew",
                            (scratch_.path() / kJournal).string()));
        }
        const Json* before = log_.find("job");
        if (before != nullptr && !job_.restart) {
            std::string changed = difference(
                *before, identity, [&](std::size_t source) { return is_as_surveyed(source); });
            if (changed.empty() && job_.output.report) {
                changed = why_no_report(log_);
            }
            if (!changed.empty()) {
                scratch_.keep(true);
                throw ConfigError(fmt::format(
                    "{}: an unfinished run of this output is there, but {}; --restart throws it "
                    "away",
                    scratch_.path().string(), changed));
            }
            scratch_.keep(log_.find("survey", kSurveyFile) != nullptr);
            progress_.note(
                fmt::format("goes on with the unfinished run in {}", scratch_.path().string()));
            return;
        }
        scratch_.keep(before != nullptr);
        check_attributes(job_, files_);
        check_keep(job_, files_);
        scratch_.keep(false);
        log_.clear();
        scratch_.clear();
        remove_unfinished_output();
        log_.record("job", "", identity);
    }

    bool is_as_surveyed(std::size_t source) const {
        const Json* survey = log_.find("survey", kSurveyFile);
        return survey == nullptr ||
               survey->at("xxh3").at(source) == xxh3_128_of_file(files_[source]);
    }

    // The error that is on its way is the one to be told.
    void throw_away() {
        scratch_.keep(false);
        try {
            remove_unfinished_output();
        } catch (const StorageError& error) {
            clock_.note(error.what());
        }
    }

    // Only a folder is filled under a name of its own for longer than a moment.
    void remove_unfinished_output() const {
        if (output_kind(job_.output.path) == OutputKind::kArchive) {
            remove_unfinished(output_path(job_.output.path));
        }
    }

    // Nothing is kept that an exception did not leave behind.
    std::string what_is_kept() const {
        return scratch_.is_kept() ? fmt::format(
                                        "; the same command goes on from what is done, in "
                                        "{}",
                                        scratch_.path().string())
                                  : "";
    }

    static StagedPoints still_there(const StagedPoints& staged) {
        return staged.stays ? staged : StagedPoints();
    }

    // The occupancy lives only as long as bricks are cut.
    Scattered cut() {
        const Survey archive = survey_all();
        const BrickPlan bricks = plan(archive);
        Forecast forecast = make_forecast(job_, archive, bricks);
        scratch_.recount();
        forecast.scratch_free_bytes += scratch_.used_bytes();
        try {
            check_forecast(forecast, job_, scratch_.path());
        } catch (const StorageError&) {
            // Nothing worth keeping, and the next run may plan with other resources.
            scratch_.keep(log_.find("scatter", kScatterFile) != nullptr);
            throw;
        }
        std::vector<BrickFile> files = scatter_all(archive, bricks);
        return {archive.table, bricks, std::move(files), still_there(archive.staged)};
    }

    Survey survey_all() {
        const fs::path file = scratch_.path() / kSurveyFile;
        Survey archive = clock_.time("survey", 0, [&](const auto& advance) -> Survey {
            if (const Json* before = log_.find("survey", kSurveyFile)) {
                SavedSurvey saved = load_survey(file, source_infos(files_));
                advance(saved.table.points());
                return {std::move(saved.table), std::move(saved.occupancy),
                        recorded_points(*before, scratch_.path())};
            }
            remove_staged(scratch_.path());
            Staging staging = plan_staging(job_, source_infos(files_), scratch_.path(),
                                           free_bytes(scratch_.path()));
            return survey({.files = files_,
                           .threads = threads_,
                           .budget_bytes = budgets_.survey,
                           .positions = staging.folder,
                           .columns = std::move(staging.columns),
                           .stays = staging.stays,
                           .standard_input = job_.standard_input},
                          advance);
        });
        if (log_.find("survey", kSurveyFile) == nullptr) {
            tell_attributes(job_, archive.table, progress_);
            save_survey(file, archive.table, archive.occupancy);
            log_.record("survey", kSurveyFile, survey_record(archive));
        }
        scratch_.keep(true);
        return archive;
    }

    BrickPlan plan(const Survey& archive) {
        const fs::path file = scratch_.path() / kPlanFile;
        BrickPlan bricks = clock_.time("plan", 0, [&](const auto&) {
            return log_.find("plan", kPlanFile) != nullptr
                       ? load_plan(file)
                       : plan_bricks(archive.occupancy, archive.table.box(),
                                     plan_request(job_, archive.table, budgets_));
        });
        if (log_.find("plan", kPlanFile) == nullptr) {
            save_plan(file, bricks);
            log_.record("plan", kPlanFile,
                        {{"bricks", bricks.bricks.size()}, {"voxel_size", bricks.voxel_size}});
        }
        return bricks;
    }

    std::vector<BrickFile> scatter_all(const Survey& archive, const BrickPlan& plan) {
        const fs::path state_file = scratch_.path() / kScatterFile;
        ScatterState state;
        if (log_.find("scatter", kScatterFile) != nullptr) {
            state = load_scatter_state(state_file);
        }
        std::vector<BrickFile> files =
            clock_.time("scatter", archive.table.points(), [&](const auto& advance) {
                if (log_.find("scatter") != nullptr) {
                    advance(archive.table.points());
                    return brick_files(scratch_.path(), plan, state);
                }
                return scatter_on(archive, plan, state, advance);
            });
        if (log_.find("scatter") == nullptr) {
            log_.record("scatter", "", Json::object());
            // The voxels were for cutting bricks.
            save_survey(scratch_.path() / kSurveyFile, archive.table,
                        Occupancy(archive.occupancy.voxel_size(), std::span<const Voxel>()));
        }
        scratch_.recount();
        return files;
    }

    std::vector<BrickFile> scatter_on(const Survey& archive, const BrickPlan& plan,
                                      const ScatterState& state,
                                      const std::function<void(std::uint64_t)>& advance) {
        const BrickMap map(archive.occupancy, plan);
        return scatter(archive.table, plan, map,
                       {.folder = scratch_.path(),
                        .staged = archive.staged,
                        .threads = threads_,
                        .budget_bytes = budgets_.stage / 4,
                        .state = state,
                        .commit =
                            [&](const ScatterState& now) {
                                scratch_.recount();
                                // The file itself is the record; the log says that there is one.
                                save_scatter_state(scratch_.path() / kScatterFile, now);
                                if (log_.find("scatter", kScatterFile) == nullptr) {
                                    log_.record("scatter", kScatterFile, Json::object());
                                }
                            },
                        .note = [&](const std::string& note) { clock_.note(note); }},
                       advance);
    }

    RankResult rank_all(const SourceTable& table, const std::vector<BrickFile>& bricks,
                        BrickMaker& maker) {
        Ranking ranking(
            table, bricks,
            {.folder = scratch_.path(),
             .curvature = job_.curvature,
             .frames = needs_frames(job_.range),
             .budget_bytes = budgets_.stage,
             .threads = threads_,
             .state = read_rank_state(log_, scratch_.path(), bricks.size()),
             .on_spacing = [&](double spacing) { record_spacing(log_, spacing); },
             .on_brick = [&](std::size_t brick,
                             const BrickRank& ranked) { record_brick(log_, brick, ranked); },
             .on_stragglers =
                 [&](const SettledStragglers& settled) { record_stragglers(log_, settled); },
             .remake = [&](std::size_t brick,
                           const std::string& why) { maker.scatter(brick, why); },
             .on_scratch = [&](std::int64_t bytes) { scratch_.grew_by(bytes); }});
        const std::uint64_t points = table.points() - table.rejected();
        const double spacing = clock_.time("spacing", points, [&](const auto& advance) {
            return ranking.measure_spacing(advance);
        });
        return clock_.time("rank", points,
                           [&](const auto& advance) { return ranking.rank(spacing, advance); });
    }

    std::uint64_t beside_selection(const SourceTable& table) const {
        // With range.keep, or all points written, there is one more for a while.
        const bool two = !job_.range.keep.empty() || job_.output.flag;
        const std::uint64_t bytes = (two ? 2 : 1) * Selection::memory_bytes(table.points());
        return budgets_.stage - std::min(budgets_.stage, bytes);
    }

    const Job& job_;
    const std::vector<fs::path>& files_;
    int threads_;
    ThreadLimit limit_;
    Budgets budgets_;
    ScratchFolder scratch_;
    JobLog log_;
    Progress& progress_;
    StageClock clock_;
};

}  // namespace

Report run(const Job& job, Progress& progress) {
    validate(job);
    const std::vector<fs::path> files = find_sources(job, progress);
    check_output(job.output, files);
    return Pipeline(job, files, progress).run();
}

}  // namespace knap
