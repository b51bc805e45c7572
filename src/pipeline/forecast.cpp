#include "pipeline/forecast.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/file.hpp"
#include "base/scratch.hpp"
#include "base/threads.hpp"
#include "emit/emit.hpp"
#include "emit/output_check.hpp"
#include "knap/error.hpp"
#include "merge/region.hpp"
#include "pipeline/repair.hpp"
#include "pipeline/sources.hpp"
#include "pipeline/stage_clock.hpp"
#include "pipeline/staging.hpp"
#include "rank/held_bricks.hpp"
#include "report/drawing.hpp"
#include "scatter/scatter.hpp"
#include "store/selection.hpp"

namespace knap {

namespace {

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

// The program itself, its libraries and their pools: resident before a point is read.
constexpr std::uint64_t kProcessBytes = 80 * kMiB;
// Grids finer than this do not make better bricks.
constexpr std::uint64_t kLargestGrid = 192 * kMiB;
// Bricks smaller than this are more halo than core.
constexpr std::uint64_t kSmallestBrick = 20'000;
// What is larger does not stay in the caches, and is long in noticing that it is to stop.
constexpr std::uint64_t kLargestBrick = 250'000;
// So that threads do not wait for the last one, and that brick files which wait for their runs are
// a small part of the scratch.
constexpr std::uint64_t kBricksPerThread = 4;
constexpr std::uint64_t kFewestBricks = 12;

// Bytes of an id in a brick file, as a difference to the one before: one for a scan in order, more
// where neighbours are far apart in the stream.
constexpr double kBrickIdBytes = 1.25;
// Bytes of a voxel in the survey's file, as steps from the one before.
constexpr double kVoxelBytes = 5;
// Bytes of a curvature in a ranked run, as a drop from the one before.
constexpr double kRunKeyBytes = 5.5;
// Of the points, where a job does not say.
constexpr double kKeptShare = 0.25;
// Repair's suspects and its copies of what is kept, over the runs, which stay.
constexpr double kRepairShare = 0.5;

std::uint64_t threads_of(const Job& job) {
    return static_cast<std::uint64_t>(thread_count(job.resources.threads));
}

std::uint64_t id_bytes(std::uint64_t points) {
    std::uint64_t bytes = 1;
    while (bytes < sizeof(PointId) && (points >> (8 * bytes)) != 0) {
        ++bytes;
    }
    return bytes;
}

/// What lies in scratch from the survey to the end.
struct StagedForecast {
    bool stays = false;
    double bytes = 0;
};

StagedForecast forecast_staged(const Job& job, const Survey& survey, std::uint64_t free) {
    if (survey.staged.files.empty()) {
        const Staging staging = plan_staging(job, survey.table.infos(), scratch_parent(job), free);
        return {staging.stays, static_cast<double>(staging.bytes)};
    }
    StagedForecast staged{survey.staged.stays, 0};
    for (const PositionFile& file : survey.staged.files) {
        staged.bytes += staged.stays ? static_cast<double>(file.bytes + file.column_bytes) : 0;
    }
    return staged;
}

/// How many points a job keeps, about.
std::uint64_t kept_about(const Job& job, const Forecast& forecast) {
    const std::uint64_t counted = forecast.points - forecast.rejected;
    if (job.range.count > 0) {
        return std::min(counted, job.range.count);
    }
    const double share = job.range.ratio > 0 ? job.range.ratio : kKeptShare;
    return static_cast<std::uint64_t>(share * static_cast<double>(counted));
}

/// Memory that emit cannot do without. Of a single file it is known only with the kept points.
std::uint64_t tile_memory_bytes(const Job& job, const Forecast& forecast) {
    if (output_kind(job.output.path) != OutputKind::kArchive) {
        return 0;
    }
    return emit_memory_bytes(kept_about(job, forecast), job.output,
                             plan_output(forecast.sources, job.output));
}

/// The kept points' runs, and the points with their rows where the memory does not hold them.
double emit_scratch_bytes(const Job& job, const Forecast& forecast, const Budgets& budgets,
                          double runs) {
    const std::uint64_t kept = kept_about(job, forecast);
    const std::uint64_t counted = forecast.points - forecast.rejected;
    if (kept == 0 || output_kind(job.output.path) != OutputKind::kArchive) {
        return 0;
    }
    const double run_point = runs / static_cast<double>(counted);
    const AttributePlan attributes = plan_output(forecast.sources, job.output);
    const bool fits = kept * emit_point_bytes(attributes) <= budgets.stage;
    // A part is there until both its halves are.
    const double through = fits ? 0 : 2 * (run_point + static_cast<double>(attributes.row_size));
    return static_cast<double>(kept) * (run_point + through);
}

}  // namespace

Budgets share_memory(std::uint64_t memory_bytes) {
    const std::uint64_t free = memory_bytes - std::min(memory_bytes, kProcessBytes);
    return {.survey = std::min(free / 3, kLargestGrid), .stage = free - free / 8};
}

PlanRequest plan_request(const Job& job, const SourceTable& table, const Budgets& budgets) {
    const std::uint64_t threads = threads_of(job);
    PlanRequest request;
    request.neighbours = job.curvature.neighbours;
    request.most_points =
        std::max<std::uint64_t>(budgets.stage / threads / rank_bytes_per_point(), 1);
    const std::uint64_t points = table.points() - table.rejected();
    const std::uint64_t even =
        std::clamp(points / std::max(kBricksPerThread * threads, kFewestBricks), kSmallestBrick,
                   kLargestBrick);
    request.target_points = job.resources.brick_points > 0 ? job.resources.brick_points
                                                           : std::min(even, request.most_points);
    return request;
}

Forecast make_forecast(const Job& job, const Survey& survey, const BrickPlan& plan) {
    const std::uint64_t threads = threads_of(job);
    Forecast forecast;
    forecast.points = survey.table.points();
    forecast.rejected = survey.table.rejected();
    forecast.box = survey.table.box();
    forecast.voxel_size = plan.voxel_size;
    forecast.occupied_voxels = survey.occupancy.voxel_count();
    forecast.bricks = plan.bricks.size();
    forecast.sources = survey.table.infos();
    std::vector<std::uint64_t> sizes;
    std::uint64_t in_bricks = 0;
    for (const Brick& brick : plan.bricks) {
        sizes.push_back(brick.core_points + brick.halo_points);
        in_bricks += sizes.back();
        forecast.halo_points += brick.halo_points;
    }
    const Budgets budgets = share_memory(job.resources.memory_bytes);
    const HeldBricks held = held_bricks(sizes, static_cast<int>(threads), budgets.stage);
    std::sort(sizes.rbegin(), sizes.rend());
    forecast.largest_brick = sizes.empty() ? 0 : sizes.front();

    std::uint64_t in_work = 0;
    for (std::size_t i = 0; i < std::min<std::size_t>(threads, sizes.size()); ++i) {
        in_work += sizes[i];
    }
    const std::uint64_t planning = 2 * survey.occupancy.memory_bytes() +
                                   survey.occupancy.voxel_count() * sizeof(Voxel) +
                                   survey_overhead_bytes(static_cast<int>(threads));
    const std::uint64_t buffers =
        scatter_buffer_bytes(forecast.bricks, static_cast<int>(threads), budgets.stage / 4);
    const std::uint64_t scattering =
        planning + std::min(buffers, 2 * survey.table.packed_size() * in_bricks);
    forecast.memory_bytes =
        kProcessBytes + std::max(scattering, held.bytes + in_work * rank_bytes_per_point());
    if (job.output.report) {
        forecast.memory_bytes =
            std::max(forecast.memory_bytes, kProcessBytes + CloudDrawing::memory_bytes() +
                                                Selection::memory_bytes(forecast.points));
    }

    forecast.memory_bytes =
        std::max(forecast.memory_bytes, kProcessBytes + Selection::memory_bytes(forecast.points) +
                                            tile_memory_bytes(job, forecast));
    forecast.scratch_free_bytes = free_bytes(scratch_parent(job));

    const std::uint64_t counted = forecast.points - forecast.rejected;
    const auto packed = static_cast<double>(survey.table.packed_size());
    const double brick_point = packed + kBrickIdBytes;
    const double voxels = kVoxelBytes * static_cast<double>(forecast.occupied_voxels);
    const double bricks = brick_point * static_cast<double>(in_bricks) + voxels;
    // Positions go as the bricks that are made from them grow.
    const auto positions = static_cast<double>(position_bytes(forecast.sources));
    const StagedForecast staged = forecast_staged(job, survey, forecast.scratch_free_bytes);
    const double scattered =
        staged.stays ? bricks : std::max(bricks, positions + voxels) + kPositionsLeft * positions;
    const double frame = needs_frames(job.range) ? PackedFrame::kBytes : 0;
    const double runs =
        (packed + kRunKeyBytes + static_cast<double>(id_bytes(forecast.points)) + frame) *
        static_cast<double>(counted);
    const double repairing = repairs(job.range) ? runs * kRepairShare : 0;
    // A brick file goes when its run is written: at the end, all runs and the last bricks.
    const double ranked = runs + std::max(repairing, brick_point * static_cast<double>(in_work));
    const double kept = emit_scratch_bytes(job, forecast, budgets, runs);
    forecast.scratch_bytes =
        static_cast<std::uint64_t>(staged.bytes + std::max({scattered, ranked, kept}));
    if (job.output.report) {
        forecast.scratch_bytes += CloudDrawing::file_bytes();
    }
    return forecast;
}

void check_forecast(const Forecast& forecast, const Job& job,
                    const std::filesystem::path& scratch) {
    if (forecast.memory_bytes > job.resources.memory_bytes) {
        throw StorageError(fmt::format(
            "resources.memory: the job needs about {} (its largest brick has {} points), {} given; "
            "raise it, or lower resources.threads",
            format_bytes(forecast.memory_bytes), forecast.largest_brick,
            format_bytes(job.resources.memory_bytes)));
    }
    if (forecast.scratch_bytes > forecast.scratch_free_bytes) {
        throw StorageError(fmt::format("{}: the job needs about {} of scratch, {} are free",
                                       scratch.string(), format_bytes(forecast.scratch_bytes),
                                       format_bytes(forecast.scratch_free_bytes)));
    }
}

std::filesystem::path scratch_parent(const Job& job) {
    if (!job.resources.scratch.empty()) {
        return job.resources.scratch;
    }
    const std::filesystem::path output = std::filesystem::absolute(job.output.path);
    return (output.has_filename() ? output : output.parent_path()).parent_path();
}

Forecast forecast(const Job& job, Progress& progress) {
    validate(job);
    const std::vector<std::filesystem::path> files = find_sources(job, progress);
    const int threads = thread_count(job.resources.threads);
    const ThreadLimit limit(threads);
    const Budgets budgets = share_memory(job.resources.memory_bytes);
    StageClock clock(progress);
    const Survey archive = clock.time("survey", 0, [&](const auto& advance) {
        return survey({.files = files, .threads = threads, .budget_bytes = budgets.survey},
                      advance);
    });
    const BrickPlan plan = clock.time("plan", 0, [&](const auto&) {
        return plan_bricks(archive.occupancy, archive.table.box(),
                           plan_request(job, archive.table, budgets));
    });
    return make_forecast(job, archive, plan);
}

}  // namespace knap
