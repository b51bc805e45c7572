#include "pipeline/report_stage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <mutex>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/threads.hpp"
#include "knap/error.hpp"
#include "merge/range_law.hpp"
#include "report/shading.hpp"

namespace knap {

namespace {

namespace fs = std::filesystem;

constexpr const char* kDraw = "draw";
constexpr const char* kDrawingFile = "drawing";

// What surveyors write has its height in z.
bool is_terrain(const SourceTable& table) {
    const auto& sources = table.sources();
    return !sources.empty() &&
           std::all_of(sources.begin(), sources.end(), [](const SourceEntry& source) {
               return source.info.coordinates.kind == CoordinateKind::kInt32;
           });
}

}  // namespace

std::string why_no_report(const JobLog& log) {
    if (log.find(kDraw, kDrawingFile) != nullptr) {
        return "";
    }
    const auto merged = log.all("merge");
    const bool removed = std::any_of(merged.begin(), merged.end(), [](const auto& step) {
        return step.second->contains("open");
    });
    return removed ? "it was begun without output.report (--report), and points that the report "
                     "would show are gone"
                   : "";
}

ReportStage::ReportStage(const SourceTable& table, const RankResult& ranked,
                         const MergeFiles& files, ScratchFolder& scratch, JobLog& log)
    : table_(table),
      ranked_(ranked),
      files_(files),
      scratch_(scratch),
      log_(log),
      scale_(ranked.mean_curvature) {}

fs::path ReportStage::file() const {
    return scratch_.path() / kDrawingFile;
}

void ReportStage::draw_all(const Advance& advance) {
    if (log_.find(kDraw, kDrawingFile) != nullptr) {
        advance(2 * ranked_.points);
    } else {
        measure_and_draw(advance);
    }
    all_ = SavedDrawing::load(file()).histogram;
}

void ReportStage::measure_and_draw(const Advance& advance) {
    CloudMeasure measure(table_.box(), is_terrain(table_), scale_);
    const CloudMeasure nothing = measure;
    std::mutex mutex;
    parallel_tasks(ranked_.bricks.size(), [&](std::size_t i) {
        CloudMeasure part = nothing;
        files_.read_ranked(i, [&]() -> TakeRanked {
            part = nothing;
            return [&](std::span<const RankedPoint> points) {
                part.add(points);
                advance(0);
            };
        });
        {
            const std::scoped_lock lock(mutex);
            measure.add(part);
        }
        advance(ranked_.bricks[i].points);
    });
    CloudDrawing drawing(measure.histogram(), measure.frames(), scale_, ranked_.spacing);
    parallel_tasks(ranked_.bricks.size(), [&](std::size_t i) {
        // Drawn twice, a point is where it was.
        files_.read_ranked(i, [&]() -> TakeRanked {
            return [&](std::span<const RankedPoint> points) {
                drawing.draw(points);
                advance(0);
            };
        });
        advance(ranked_.bricks[i].points);
    });
    scratch_.grew_by(static_cast<std::int64_t>(drawing.save(file())));
    log_.record(kDraw, kDrawingFile, {{"points", ranked_.points}});
}

void ReportStage::read_kept(const Merged& merged, const std::function<TakeRanked()>& begin,
                            const std::function<void(const std::string&)>& note) const {
    const Selection& selection = merged.result.selection;
    const auto of_selection = [&](const TakeRanked& take) -> TakeRanked {
        return [&selection, take](std::span<const RankedPoint> points) {
            std::vector<RankedPoint> kept;
            std::copy_if(points.begin(), points.end(), std::back_inserter(kept),
                         [&](const RankedPoint& point) { return selection.test(point.id); });
            take(kept);
        };
    };
    try {
        const TakeRanked take = of_selection(begin());
        parallel_tasks(merged.runs.size(), [&](std::size_t i) {
            RunReader reader(merged.runs[i], table_);
            for (std::vector<RankedPoint> block; reader.next(block);) {
                take(block);
            }
        });
    } catch (const StorageError& error) {
        note(std::string(error.what()) + "; kept points are ranked again for the report");
        const TakeRanked take = of_selection(begin());
        for (std::size_t i = 0; i < ranked_.bricks.size(); ++i) {
            std::vector<RankedPoint> brick;
            files_.read_ranked(i, [&]() -> TakeRanked {
                brick.clear();
                return [&](std::span<const RankedPoint> points) {
                    brick.insert(brick.end(), points.begin(), points.end());
                };
            });
            take(brick);
        }
    }
}

void ReportStage::draw_kept(const Merged& merged, const RangeParams& range, const Advance& advance,
                            const std::function<void(const std::string&)>& note) {
    std::mutex mutex;
    read_kept(
        merged,
        [&]() -> TakeRanked {
            kept_ = {};
            return [&](std::span<const RankedPoint> points) {
                CurvatureHistogram part;
                for (const RankedPoint& point : points) {
                    part.add(scale_.code_of(point.key));
                }
                const std::scoped_lock lock(mutex);
                kept_.add(part);
            };
        },
        note);
    const std::uint64_t count = merged.result.kept;
    advance(count);
    const SavedDrawing drawing = SavedDrawing::load(file());
    const RangeLaw law(range, ranked_.mean_curvature);
    for (std::size_t i = 0; i < drawing.frames.size(); ++i) {
        const Frame& frame = drawing.frames[i];
        const Relief surface = surface_of(drawing.splats(i), frame, scale_, ranked_.spacing);
        if (i == 0) {
            colours_ = CurvatureColours::of(pixel_histogram(surface));
        }
        const auto draw = [&](KeptDrawing::Kind kind) {
            KeptDrawing kept(
                kind, frame, surface, [&](double curvature) { return law.of(curvature); },
                ranked_.spacing, count);
            read_kept(
                merged,
                [&]() -> TakeRanked {
                    return [&](std::span<const RankedPoint> points) {
                        kept.draw(points);
                        advance(0);
                    };
                },
                note);
            advance(count);
            return kind == KeptDrawing::Kind::kDots ? shade_dots(surface, kept.splats(), colours_)
                                                    : shade(kept.relief(), colours_);
        };
        const std::array<Image, 3> images{shade(surface, colours_), draw(KeptDrawing::Kind::kCells),
                                          draw(KeptDrawing::Kind::kDots)};
        std::array<std::vector<std::byte>, 3> files;
        parallel_tasks(files.size(), [&](std::size_t k) { files[k] = encode_png(images[k]); });
        views_.push_back({.name = frame.view.name,
                          .width = frame.width / 2,
                          .height = frame.height / 2,
                          .all = std::move(files[0]),
                          .kept = std::move(files[1]),
                          .dots = std::move(files[2])});
    }
}

std::string ReportStage::page(const Job& job, const Report& report) {
    const RangeLaw law(job.range, ranked_.mean_curvature);
    return format_report_page({.job = job,
                               .report = report,
                               .sources = table_,
                               .scale = scale_,
                               .all = all_,
                               .kept = kept_,
                               .colours = colours_,
                               .range_of = [law](double curvature) { return law.of(curvature); },
                               .views = std::move(views_)});
}

}  // namespace knap
