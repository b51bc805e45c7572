#include "pipeline/emit_stage.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "base/file.hpp"
#include "emit/emit.hpp"
#include "emit/output_check.hpp"
#include "merge/range_law.hpp"
#include "pipeline/tile_records.hpp"
#include "store/manifest.hpp"
#include "tileset/tileset.hpp"

namespace knap {

namespace {

namespace fs = std::filesystem;

class Emitting {
  public:
    explicit Emitting(const EmitStage& stage) : stage_(stage), done_(stage.job) {
        done_.range.alpha = stage.merged.alpha;
    }

    Report run() {
        const Selection& selection = stage_.merged.result.selection;
        // All that can fail for want of room comes before the output has its name.
        const std::unique_ptr<AtomicFile> ids =
            stage_.job.output.ids.empty() ? nullptr : write_ids(stage_.job.output.ids, selection);
        if (stage_.report != nullptr) {
            draw_kept();
        }
        const EmitResult emitted = stage_.clock.time(
            "emit", stage_.table.points(),
            [&](const auto& advance) { return emit(stage_.table, selection, request(advance)); });
        if (page_) {
            page_->commit();
        }
        if (ids) {
            ids->commit();
        }
        Report report = report_of(emitted);
        report.stages = stage_.clock.take_reports();
        return report;
    }

  private:
    void draw_kept() const {
        const auto note = [&](const std::string& text) { stage_.clock.note(text); };
        stage_.clock.time("draw kept", 0, [&](const auto& advance) {
            stage_.report->draw_kept(stage_.merged, done_.range, advance, note);
            return true;
        });
    }

    EmitRequest request(const std::function<void(std::uint64_t)>& advance) {
        EmitRequest request;
        request.counts = counts();
        request.spacing = stage_.ranked.spacing;
        request.mean_curvature = stage_.ranked.mean_curvature;
        request.parameters = result_parameters(done_);
        request.output = stage_.job.output;
        request.memory_bytes = stage_.memory_bytes;
        request.threads = stage_.threads;
        request.scratch = stage_.scratch.path();
        request.runs = stage_.merged.runs;
        request.range_of = [law = RangeLaw(done_.range, stage_.ranked.mean_curvature)](
                               double curvature) { return law.of(curvature); };
        request.staged = stage_.staged;
        request.tiles = {.done = read_tiles(stage_.log),
                         .on_tile = [&](std::size_t number, const ManifestTile& tile) {
                             record_tile(stage_.log, number, tile);
                         }};
        request.advance = advance;
        poll_ = advance;
        request.on_scratch = [&](std::int64_t bytes) { stage_.scratch.grew_by(bytes); };
        request.on_whole = [&](const EmitResult& result, const fs::path& folder) {
            if (stage_.job.output.tileset) {
                write_tileset(folder);
            }
            if (stage_.report != nullptr) {
                write_page(result, folder);
            }
        };
        request.note = [&](const std::string& note) { stage_.clock.note(note); };
        return request;
    }

    Counts counts() const {
        return {.in = stage_.table.points(),
                .kept = stage_.merged.result.kept,
                .represented = stage_.merged.result.represented,
                .merged = stage_.ranked.merged,
                .rejected = stage_.table.rejected()};
    }

    // It gets its name with the folder, as the page does.
    void write_tileset(const fs::path& folder) {
        tileset_ = make_tileset(folder, {.threads = stage_.threads,
                                         .memory_bytes = stage_.memory_bytes,
                                         .overwrite = true,
                                         .advance = [&](std::uint64_t) { poll_(0); }});
        for (const std::string& note : tileset_.notes) {
            stage_.clock.note(note);
        }
    }

    // In an archive it gets its name with the folder; beside a file, just after the file.
    void write_page(const EmitResult& result, const fs::path& folder) {
        Report report = report_of(result);
        report.stages = stage_.clock.reports_so_far();
        const bool inside = output_kind(stage_.job.output.path) == OutputKind::kArchive;
        auto page = std::make_unique<AtomicFile>(inside ? folder / kReportName
                                                        : report_path(stage_.job.output.path));
        page->write(stage_.report->page(done_, report));
        if (inside) {
            page->commit();
        } else {
            page_ = std::move(page);
        }
    }

    Report report_of(const EmitResult& emitted) const {
        Report report;
        report.counts = counts();
        report.spacing = stage_.ranked.spacing;
        report.mean_curvature = stage_.ranked.mean_curvature;
        report.alpha = stage_.merged.alpha;
        report.box = stage_.table.box();
        report.sources = stage_.table.sources().size();
        report.bricks = stage_.ranked.bricks.size();
        report.stragglers = stage_.ranked.stragglers;
        report.protected_points = stage_.merged.protected_points;
        report.tiles = emitted.tiles;
        report.output_bytes = emitted.bytes;
        report.tileset_tiles = tileset_.tiles;
        report.tileset_bytes = tileset_.bytes;
        report.output = emitted.path;
        report.scratch_peak_bytes = stage_.scratch.peak_bytes();
        report.memory_peak_bytes = peak_resident_bytes();
        return report;
    }

    const EmitStage& stage_;
    Job done_;
    std::unique_ptr<AtomicFile> page_;
    TilesetResult tileset_;
    std::function<void(std::uint64_t)> poll_;
};

}  // namespace

Report emit_output(const EmitStage& stage) {
    return Emitting(stage).run();
}

}  // namespace knap
