#include "app/summary.hpp"

#include <fmt/format.h>

#include "app/format.hpp"
#include "base/file.hpp"

namespace knap::app {

namespace {

std::string row(std::string_view name, const std::string& value) {
    return fmt::format("{:<16} {}\n", name, value);
}

std::string count_row(std::string_view name, std::uint64_t count, std::uint64_t all) {
    return fmt::format("  {:<14} {:>15}  {:>8}\n", name, format_count(count),
                       format_share(count, all));
}

std::string format_counts(const Report& report) {
    const Counts& counts = report.counts;
    std::string text = fmt::format("{:<16} {:>15}\n", "points in", format_count(counts.in));
    text += count_row("kept", counts.kept, counts.in);
    if (report.protected_points > 0) {
        text += count_row("  protected", report.protected_points, counts.in);
    }
    text += count_row("represented", counts.represented, counts.in);
    text += count_row("merged", counts.merged, counts.in);
    text += count_row("rejected", counts.rejected, counts.in);
    if (counts.kept > 0) {
        text += row("ratio", fmt::format("1 in {:.1f}", static_cast<double>(counts.in) /
                                                            static_cast<double>(counts.kept)));
    }
    return text;
}

std::string stage_row(const std::string& name, double seconds, std::uint64_t points) {
    return fmt::format("{:<16} {:>15} {:>14} {:>12}\n", name, format_seconds(seconds),
                       format_count(points), format_rate(static_cast<double>(points) / seconds));
}

std::string format_stages(const Report& report, double seconds) {
    std::string text =
        fmt::format("{:<16} {:>15} {:>14} {:>12}\n", "stage", "time", "points", "points/s");
    for (const StageReport& stage : report.stages) {
        text += stage_row(stage.name, stage.seconds, stage.points);
    }
    return text + stage_row("whole job", seconds, report.counts.in);
}

std::string format_extent(const Box& box) {
    if (box.empty()) {
        return "empty";
    }
    const Vec3 size = box.size();
    return fmt::format("{:.6g} x {:.6g} x {:.6g} cloud units", size.x, size.y, size.z);
}

}  // namespace

std::string format_summary(const Report& report, double seconds) {
    std::string text = format_counts(report) + "\n";
    text += row("extent", format_extent(report.box));
    text += row("mean spacing", fmt::format("{:.6g} cloud units", report.spacing));
    text += row("mean |H|", fmt::format("{:.6g} / cloud unit", report.mean_curvature));
    text += row("alpha", fmt::format("{:.6g} cloud units", report.alpha));
    text += row("sources", format_count(report.sources));
    text += row("bricks", fmt::format("{}, {} stragglers", format_count(report.bricks),
                                      format_count(report.stragglers)));
    text += fmt::format("\n{}\n", format_stages(report, seconds));
    text += row("memory peak", format_bytes(report.memory_peak_bytes));
    text += row("scratch peak", format_bytes(report.scratch_peak_bytes));
    std::string output = format_bytes(report.output_bytes);
    if (report.tiles > 0) {
        output += fmt::format(" in {} {}", format_count(report.tiles),
                              report.tiles == 1 ? "tile" : "tiles");
    }
    if (report.counts.kept > 0) {
        output +=
            fmt::format(", {:.2f} bytes a kept point", static_cast<double>(report.output_bytes) /
                                                           static_cast<double>(report.counts.kept));
    }
    text += row("output size", output);
    if (report.tileset_tiles > 0) {
        text += row("3D Tiles", fmt::format("{} in {} {}", format_bytes(report.tileset_bytes),
                                            format_count(report.tileset_tiles),
                                            report.tileset_tiles == 1 ? "tile" : "tiles"));
    }
    text += row("result", report.output.string());
    return text;
}

std::string format_forecast(const Forecast& forecast, std::uint64_t memory_bytes) {
    const bool scratch_fits = forecast.scratch_bytes <= forecast.scratch_free_bytes;
    const bool memory_fits = forecast.memory_bytes <= memory_bytes;
    std::string text = row("sources", format_count(forecast.sources.size()));
    text += row("points", fmt::format("{} ({} rejected)", format_count(forecast.points),
                                      format_count(forecast.rejected)));
    text += row("extent", format_extent(forecast.box));
    text += row("voxel", fmt::format("{:.6g} cloud units, {} occupied", forecast.voxel_size,
                                     format_count(forecast.occupied_voxels)));
    text += row("bricks", format_count(forecast.bricks));
    text += row("largest brick", format_count(forecast.largest_brick) + " points with its halo");
    text +=
        row("halo copies", fmt::format("{} points, {} of all", format_count(forecast.halo_points),
                                       format_share(forecast.halo_points, forecast.points)));
    text +=
        row("memory", fmt::format("{} of {} allowed{}", format_bytes(forecast.memory_bytes),
                                  format_bytes(memory_bytes), memory_fits ? "" : ": does not fit"));
    text += row("scratch", fmt::format("{} of {} free{}", format_bytes(forecast.scratch_bytes),
                                       format_bytes(forecast.scratch_free_bytes),
                                       scratch_fits ? "" : ": does not fit"));
    return text;
}

}  // namespace knap::app
