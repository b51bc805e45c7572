#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>

#include "base/scratch.hpp"
#include "base/threads.hpp"
#include "emit/emit.hpp"
#include "emit/output_check.hpp"
#include "knap/error.hpp"
#include "knap/job.hpp"
#include "knap/source.hpp"
#include "merge/merge.hpp"
#include "pipeline/forecast.hpp"
#include "pipeline/stage_clock.hpp"
#include "plan/plan.hpp"
#include "rank/rank.hpp"
#include "scatter/scatter.hpp"
#include "store/brick_map.hpp"
#include "store/journal.hpp"
#include "survey/survey.hpp"

namespace knap {

namespace {

constexpr const char* kJournal = "journal";
constexpr const char* kSelectionFile = "selection";

/// The stages of one job, each a value from the value before; what they left on disk is named in
/// the journal before the next one begins.
class Pipeline {
  public:
    Pipeline(const Job& job, std::vector<std::filesystem::path> files, Progress& progress)
        : job_(job),
          files_(std::move(files)),
          threads_(thread_count(job.resources.threads)),
          limit_(threads_),
          budgets_(share_memory(job.resources.memory_bytes)),
          scratch_(scratch_parent(job)),
          progress_(progress),
          clock_(progress) {}

    Report run() {
        BrickFiles bricks = cut();
        const SourceTable table = std::move(bricks.table);
        const RankResult ranked = rank_all(table, bricks.files);
        const MergeResult merged = merge_all(table, ranked);
        return emit_all(table, bricks.files.size(), ranked, merged);
    }

    Forecast forecast() {
        const Survey archive = survey_all();
        return make_forecast(job_, archive, plan(archive));
    }

  private:
    struct BrickFiles {
        SourceTable table;
        std::vector<BrickFile> files;
    };

    // The occupancy lives only as long as bricks are cut.
    BrickFiles cut() {
        Survey archive = survey_all();
        const BrickPlan bricks = plan(archive);
        check_forecast(make_forecast(job_, archive, bricks), job_, scratch_.path());
        return {archive.table, scatter_all(archive, bricks)};
    }

    Survey survey_all() {
        Survey archive = clock_.time("survey", 0, [&](const auto& advance) {
            return survey({.files = files_, .threads = threads_, .budget_bytes = budgets_.survey},
                          advance);
        });
        tell_what_stays_behind(archive.table);
        record("survey", "",
               {{"points", archive.table.points()}, {"rejected", archive.table.rejected()}});
        return archive;
    }

    // Nothing is dropped without a word.
    void tell_what_stays_behind(const SourceTable& table) {
        std::set<std::string> names;
        for (const SourceEntry& source : table.sources()) {
            for (const Attribute& attribute : source.info.schema) {
                if (attribute.name.find_first_not_of("xyzXYZ") != std::string::npos) {
                    names.insert(attribute.name);
                }
            }
        }
        if (!names.empty()) {
            progress_.note(fmt::format("only positions are written; {} attributes stay behind: {}",
                                       names.size(), fmt::join(names, ", ")));
        }
    }

    BrickPlan plan(const Survey& archive) {
        BrickPlan bricks = clock_.time("plan", 0, [&](const auto&) {
            return plan_bricks(archive.occupancy, archive.table.box(),
                               plan_request(job_, archive.table, budgets_));
        });
        record("plan", "", {{"bricks", bricks.bricks.size()}, {"voxel_size", bricks.voxel_size}});
        return bricks;
    }

    std::vector<BrickFile> scatter_all(const Survey& archive, const BrickPlan& bricks) {
        std::vector<VoxelBox> cores;
        std::vector<VoxelBox> reaches;
        for (const Brick& brick : bricks.bricks) {
            cores.push_back(brick.core);
            reaches.push_back(voxels_touched(brick, bricks.voxel_size));
        }
        std::vector<BrickFile> files =
            clock_.time("scatter", archive.table.points(), [&](const auto& advance) {
                const BrickMap map(archive.occupancy, cores, reaches);
                return scatter(archive.table, bricks, map,
                               {.folder = scratch_.path(),
                                .threads = threads_,
                                .budget_bytes = budgets_.stage / 4},
                               advance);
            });
        for (const BrickFile& file : files) {
            scratch_.grew_by(static_cast<std::int64_t>(file.bytes));
            record("scatter", file.path.filename().string(),
                   {{"core", file.core_points}, {"halo", file.halo_points}, {"bytes", file.bytes}});
        }
        return files;
    }

    RankResult rank_all(const SourceTable& table, const std::vector<BrickFile>& bricks) {
        RankResult ranked = clock_.time("rank", table.points(), [&](const auto& advance) {
            return rank(table, bricks,
                        {.folder = scratch_.path(),
                         .curvature = job_.curvature,
                         .budget_bytes = budgets_.stage,
                         .on_scratch = [&](std::int64_t bytes) { scratch_.grew_by(bytes); }},
                        advance);
        });
        for (const RankedFiles& brick : ranked.bricks) {
            for (const auto& path : brick.runs) {
                record("rank", path.filename().string(), nlohmann::ordered_json::object());
            }
        }
        return ranked;
    }

    MergeResult merge_all(const SourceTable& table, const RankResult& ranked) {
        std::vector<std::filesystem::path> spilled(ranked.bricks.size());
        MergeResult merged = clock_.time("merge", ranked.points, [&](const auto& advance) {
            std::vector<RankedPart> parts;
            for (const RankedFiles& brick : ranked.bricks) {
                parts.push_back({{}, brick.box, brick.points});
                for (const auto& path : brick.runs) {
                    parts.back().runs.push_back(std::make_unique<RunReader>(path, table));
                }
            }
            return merge(std::move(parts),
                         {.range = job_.range,
                          .mean_curvature = ranked.mean_curvature,
                          .points = table.points(),
                          .box = table.box(),
                          .budget_bytes = budgets_.stage,
                          .spill =
                              [&](std::size_t brick, const std::vector<RankedPoint>& open) {
                                  spilled[brick] =
                                      write_open_run(table, brick, open, spilled.size());
                                  return std::make_unique<RunReader>(spilled[brick], table);
                              },
                          .on_settled =
                              [&](std::size_t brick) {
                                  for (const auto& path : ranked.bricks[brick].runs) {
                                      remove(path);
                                  }
                              }},
                         advance);
        });
        merged.selection.save(scratch_.path() / kSelectionFile);
        record("merge", kSelectionFile,
               {{"kept", merged.kept}, {"represented", merged.represented}});
        scratch_.grew_by(static_cast<std::int64_t>(
            std::filesystem::file_size(scratch_.path() / kSelectionFile)));
        for (const auto& path : spilled) {
            if (!path.empty()) {
                remove(path);
            }
        }
        return merged;
    }

    // What a brick leaves open is read with that of all others, a block of each at a time.
    std::filesystem::path write_open_run(const SourceTable& table, std::size_t brick,
                                         const std::vector<RankedPoint>& open, std::size_t bricks) {
        constexpr std::uint64_t kSmallest = 64;
        const std::uint64_t share = budgets_.stage / 8 / bricks / (2 * sizeof(RankedPoint));
        const std::uint64_t block = std::clamp<std::uint64_t>(share, kSmallest, kMostBlockPoints);
        std::filesystem::path path = scratch_.path() / fmt::format("{:06}.open", brick);
        scratch_.grew_by(static_cast<std::int64_t>(write_run(path, table, open, block)));
        return path;
    }

    void remove(const std::filesystem::path& path) {
        const auto bytes = static_cast<std::int64_t>(std::filesystem::file_size(path));
        std::filesystem::remove(path);
        scratch_.grew_by(-bytes);
    }

    Report emit_all(const SourceTable& table, std::size_t bricks, const RankResult& ranked,
                    const MergeResult& merged) {
        Report report;
        report.counts = {.in = table.points(),
                         .kept = merged.kept,
                         .represented = merged.represented,
                         .merged = ranked.merged,
                         .rejected = table.rejected()};
        const EmitResult emitted = clock_.time("emit", table.points(), [&](const auto& advance) {
            return emit(table, merged.selection,
                        {.counts = report.counts,
                         .spacing = ranked.spacing,
                         .mean_curvature = ranked.mean_curvature,
                         .parameters = result_parameters(job_),
                         .output = job_.output,
                         .memory_bytes = budgets_.stage,
                         .threads = threads_,
                         .advance = advance});
        });
        record("emit", "", {{"tiles", emitted.tiles}, {"bytes", emitted.bytes}});
        if (!job_.output.ids.empty()) {
            write_ids(job_.output.ids, merged.selection);
        }
        report.spacing = ranked.spacing;
        report.mean_curvature = ranked.mean_curvature;
        report.box = table.box();
        report.sources = table.sources().size();
        report.bricks = bricks;
        report.stragglers = ranked.stragglers;
        report.tiles = emitted.tiles;
        report.output_bytes = emitted.bytes;
        report.output = emitted.path;
        report.scratch_peak_bytes = scratch_.peak_bytes();
        report.memory_peak_bytes = peak_resident_bytes();
        report.stages = clock_.take_reports();
        return report;
    }

    void record(const char* stage, std::string file, const nlohmann::ordered_json& details) {
        append_to_journal(scratch_.path() / kJournal, {stage, std::move(file), details.dump()});
    }

    const Job& job_;
    std::vector<std::filesystem::path> files_;
    int threads_;
    ThreadLimit limit_;
    Budgets budgets_;
    ScratchFolder scratch_;
    Progress& progress_;
    StageClock clock_;
};

std::vector<std::filesystem::path> find_sources(const Job& job, Progress& progress) {
    std::vector<std::filesystem::path> left_out;
    std::vector<std::filesystem::path> files = expand_sources(job.input, &left_out);
    if (!left_out.empty()) {
        progress.note(
            fmt::format("{} files of the input folders are no point clouds that knap reads, "
                        "and are left out; the first is {}",
                        left_out.size(), left_out.front().string()));
    }
    return files;
}

}  // namespace

Report run(const Job& job, Progress& progress) {
    validate(job);
    std::vector<std::filesystem::path> files = find_sources(job, progress);
    check_output(job.output, files);
    return Pipeline(job, std::move(files), progress).run();
}

Forecast forecast(const Job& job, Progress& progress) {
    validate(job);
    return Pipeline(job, find_sources(job, progress), progress).forecast();
}

}  // namespace knap
