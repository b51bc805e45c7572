#include "report/report_page.hpp"

#include <fmt/format.h>

#include <numeric>

#include "base/file.hpp"
#include "base/format.hpp"
#include "report/error_section.hpp"
#include "report/html.hpp"
#include "report/log_bars.hpp"

namespace knap {

namespace {

constexpr std::string_view kAllSwatch =
    "<span class=\"swatch\" style=\"background:var(--all)\"></span>all points";
constexpr std::string_view kKeptSwatch =
    "<span class=\"swatch\" style=\"background:var(--kept)\"></span>kept points";

std::uint64_t source_bytes(const SourceTable& sources) {
    return std::accumulate(
        sources.sources().begin(), sources.sources().end(), std::uint64_t{0},
        [](std::uint64_t sum, const SourceEntry& source) { return sum + source.info.size_bytes; });
}

std::string ratio(std::uint64_t whole, std::uint64_t part) {
    return part == 0
               ? "-"
               : fmt::format("{:.1f}", static_cast<double>(whole) / static_cast<double>(part));
}

std::string key_figure(std::string_view name, const std::string& value, const std::string& more) {
    return fmt::format(
        "<div><span class=\"soft\">{}</span><b>{}</b><span class=\"soft\">{}</span></div>\n", name,
        value, more);
}

std::string format_head(const ReportPage& page) {
    const Counts& counts = page.report.counts;
    const std::uint64_t in = source_bytes(page.sources);
    const std::uint64_t out = page.report.output_bytes;
    const std::string name = escape_html(page.report.output.filename().string());
    std::string text =
        fmt::format("<h1>{}</h1>\n<p class=\"soft\">Report of knap {}</p>\n", name, KNAP_VERSION);
    text += "<div class=\"key\">\n";
    text += key_figure("points in", format_count(counts.in),
                       fmt::format("{} {}", format_count(page.report.sources),
                                   page.report.sources == 1 ? "source" : "sources"));
    text += key_figure("points kept", format_count(counts.kept),
                       format_share(counts.kept, counts.in) + " of all");
    text += key_figure("one point in", ratio(counts.in, counts.kept), "is kept");
    text += key_figure("size", format_bytes(out), fmt::format("of {}", format_bytes(in)));
    text +=
        key_figure("size ratio", ratio(in, out),
                   counts.kept == 0
                       ? ""
                       : fmt::format("{:.2f} bytes a kept point",
                                     static_cast<double>(out) / static_cast<double>(counts.kept)));
    return text + "</div>\n";
}

std::string format_picture(const ReportView& view, const std::vector<std::byte>& png,
                           std::string_view what) {
    return fmt::format(
        "<figure><img src=\"{}\" width=\"{}\" height=\"{}\" alt=\"{}, {}\"><figcaption><b>{}</b>, "
        "{}</figcaption></figure>\n",
        data_uri("image/png", png), view.width, view.height, what, escape_html(view.name), what,
        escape_html(view.name));
}

std::string hex(const Colour& colour) {
    return fmt::format("#{:02x}{:02x}{:02x}", colour[0], colour[1], colour[2]);
}

/// Three digits, without an exponent where that is as short.
std::string short_number(double value) {
    return value >= 1000 && value < 1e6 ? fmt::format("{:.0f}", value)
                                        : fmt::format("{:.3g}", value);
}

std::string format_legend(const ReportPage& page) {
    constexpr int kStops = 16;
    constexpr int kTicks = 4;
    const CurvatureColours& colours = page.colours;
    std::string text =
        "<svg class=\"legend\" viewBox=\"0 0 560 58\" role=\"img\" aria-label=\"colours of mean "
        "curvature\"><defs><linearGradient id=\"map\">";
    for (int i = 0; i <= kStops; ++i) {
        const double place = static_cast<double>(i) / kStops;
        text += fmt::format(R"(<stop offset="{:.4f}" stop-color="{}"/>)", place,
                            hex(to_screen(map_colour(place))));
    }
    text +=
        "</linearGradient></defs><rect x=\"50\" y=\"4\" width=\"460\" height=\"14\" rx=\"2\" "
        "fill=\"url(#map)\"/>";
    for (int i = 0; i <= kTicks && colours.high > colours.low; ++i) {
        const std::uint32_t code = colours.low + (colours.high - colours.low) * i / kTicks;
        const double x = 50 + 460.0 * i / kTicks;
        text += fmt::format(
            "<line class=\"tick\" x1=\"{0}\" x2=\"{0}\" y1=\"18\" y2=\"23\"/><text x=\"{0}\" "
            "y=\"36\" text-anchor=\"middle\">{1}{2}</text>",
            x,
            i == 0        ? "≤ "
            : i == kTicks ? "≥ "
                          : "",
            short_number(page.scale.curvature_of(code)));
    }
    return text +
           "<text class=\"axis\" x=\"280\" y=\"54\" text-anchor=\"middle\">mean curvature |H|, 1 / "
           "cloud unit</text></svg>\n";
}

std::string format_pictures(const ReportPage& page) {
    std::string text = "<section id=\"pictures\"><h2>Before and after</h2>\n";
    for (const ReportView& view : page.views) {
        text += "<div class=\"pair\">\n" + format_picture(view, view.all, "before: all points") +
                format_picture(view, view.kept, "after: the kept points as a surface") + "</div>\n";
    }
    text += "<div class=\"pair\">\n";
    for (const ReportView& view : page.views) {
        text += format_picture(view, view.dots, "after: the kept points as dots");
    }
    text += "</div>\n" + format_legend(page);
    return text +
           fmt::format(
               "<p class=\"soft\" style=\"margin-top:12px\">Colour is mean curvature |H| on a "
               "logarithmic scale, as the mean over a few pixels; the scale is clipped where "
               "{:.0f} % of the first picture's pixels are below and {:.0f} % above. Before: each "
               "point is a disc of 2 mean spacings. After: each place of that surface shows the "
               "nearest kept point, as far as its range reaches, with one colour and one facing, "
               "those of the surface at the point. Dots are the kept points in one size, over the "
               "surface in grey. Kept points that the surface hides from the eye are left out, and "
               "a few far outliers may lie outside the pictures.</p></section>\n",
               100 * CurvatureColours::kLowShare, 100 * (1 - CurvatureColours::kHighShare));
}

std::string format_outside(const LogBars& bars, std::string_view what) {
    if (bars.outside.all == 0) {
        return "";
    }
    return fmt::format(" Not shown, as their {}: {} points, {} of them kept.", what,
                       format_count(bars.outside.all), format_count(bars.outside.kept));
}

std::string format_histograms(const ReportPage& page) {
    const LogBars curvature = log_bars(
        page.scale, page.all, page.kept, [](double value) { return value; }, 3);
    const LogBars range = log_bars(page.scale, page.all, page.kept, page.range_of, 8);
    return fmt::format(
        "<section id=\"histograms\"><h2>Curvature and range</h2>\n<p>Share of the points, each of "
        "its own sum: {}{}</p>\n<div class=\"pair\"><div><h3>Curvature</h3>{}</div>"
        "<div><h3>Range</h3>{}</div></div>\n<p class=\"soft\">Bars are equally wide on a "
        "logarithmic scale; the outermost ones also hold what is beyond. Ranges end at "
        "range.min_factor and range.max_factor times alpha: what would be below or above is in the "
        "bars there.{}{}</p></section>\n",
        kAllSwatch, kKeptSwatch,
        format_chart(curvature, {"curvature", "mean curvature |H|, 1 / cloud unit"}),
        format_chart(range, {"range", "range of a point, cloud units"}),
        format_outside(curvature, "curvature is 0"), format_outside(range, "range is infinite"));
}

std::string format_counts(const Counts& counts) {
    const auto term = [&](std::string_view name, std::uint64_t count) {
        return fmt::format("<span><b>{}</b>{} <span class=\"soft\">{}</span></span>",
                           format_count(count), name, format_share(count, counts.in));
    };
    const auto part = [&](std::string_view colour, std::uint64_t count) {
        return fmt::format(
            "<div style=\"width:{:.4f}%;background:{}\"></div>",
            counts.in == 0 ? 0.0
                           : 100.0 * static_cast<double>(count) / static_cast<double>(counts.in),
            colour);
    };
    return fmt::format(
        "<section id=\"counts\"><h2>Where the points went</h2>\n<div class=\"sum\">{}<i>=</i>{}"
        "<i>+</i>{}<i>+</i>{}<i>+</i>{}</div>\n<div class=\"bar\">{}{}{}{}</div>\n"
        "<p class=\"soft\" style=\"margin-top:10px\">Represented: within the range of a kept "
        "point. "
        "Merged: in the place of another point. Rejected: a coordinate was not "
        "finite.</p></section>\n",
        term("in", counts.in), term("kept", counts.kept), term("represented", counts.represented),
        term("merged", counts.merged), term("rejected", counts.rejected),
        part("var(--kept)", counts.kept), part("var(--all)", counts.represented),
        part("#55606b", counts.merged), part("#1d2126", counts.rejected));
}

std::string format_cloud(const Report& report) {
    const auto row = [](std::string_view name, const std::string& value) {
        return fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", name, value);
    };
    std::string text = "<section id=\"cloud\"><h2>Cloud</h2>\n<table><tbody>\n";
    const Box& box = report.box;
    if (!box.empty()) {
        text += row("box", fmt::format("{} to {}, {} to {}, {} to {} cloud units", box.min.x,
                                       box.max.x, box.min.y, box.max.y, box.min.z, box.max.z));
        const Vec3 size = box.size();
        text += row("extent",
                    fmt::format("{:.6g} × {:.6g} × {:.6g} cloud units", size.x, size.y, size.z));
    }
    text += row("mean spacing", fmt::format("{:.6g} cloud units", report.spacing));
    text += row("mean curvature |H|", fmt::format("{:.6g} / cloud unit", report.mean_curvature));
    text += row("alpha", fmt::format("{:.6g} cloud units", report.alpha) +
                             (report.spacing > 0 ? fmt::format(", {:.3g} mean spacings",
                                                               report.alpha / report.spacing)
                                                 : ""));
    text += row("output",
                fmt::format("{}{}", format_bytes(report.output_bytes),
                            report.tiles == 0 ? ""
                                              : fmt::format(", {} {}", format_count(report.tiles),
                                                            report.tiles == 1 ? "tile" : "tiles")));
    return text + "</tbody></table></section>\n";
}

}  // namespace

std::string format_report_page(const ReportPage& page) {
    const std::string name = escape_html(page.report.output.filename().string());
    return fmt::format(
               "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
               "<meta name=\"viewport\" content=\"width=device-width\">\n"
               "<title>{}: report of knap</title>\n<style>{}</style></head>\n<body><main>\n",
               name, report_style()) +
           format_head(page) + format_pictures(page) + format_counts(page.report.counts) +
           format_error_section(std::nullopt) + format_histograms(page) +
           format_cloud(page.report) + format_source_section(page.sources) +
           format_parameter_section(page.job) + format_cost_section(page) +
           "</main></body></html>\n";
}

}  // namespace knap
