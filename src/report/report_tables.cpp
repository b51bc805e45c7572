#include <fmt/format.h>

#include "base/file.hpp"
#include "base/format.hpp"
#include "report/html.hpp"
#include "report/report_page.hpp"

namespace knap {

namespace {

constexpr std::size_t kMostSources = 200;

std::string fact(std::string_view name, const std::string& value) {
    return fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", name, value);
}

}  // namespace

std::string format_source_section(const SourceTable& sources) {
    std::string text = fmt::format(
        "<section id=\"sources\"><h2>Sources</h2>\n<div class=\"wide\"><table class=\"figures\">"
        "<thead><tr><th>file</th><th>points</th><th>rejected</th><th>size</th><th>format</th></tr>"
        "</thead><tbody>\n");
    std::size_t shown = 0;
    for (const SourceEntry& source : sources.sources()) {
        if (++shown > kMostSources) {
            break;
        }
        text += fmt::format(
            "<tr><th class=\"path\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
            escape_html(source.given_path), format_count(source.points),
            format_count(source.rejected), format_bytes(source.info.size_bytes),
            escape_html(source.info.format));
    }
    text += "</tbody></table></div>\n";
    if (sources.sources().size() > kMostSources) {
        text += fmt::format("<p class=\"soft\">and {} more</p>\n",
                            format_count(sources.sources().size() - kMostSources));
    }
    return text + "</section>\n";
}

std::string format_parameter_rows(const Job& job, bool resources) {
    std::string text;
    for (const Parameter& parameter : parameters()) {
        const bool is_resource = parameter.key.starts_with("resources.");
        if (parameter.key == "input" || is_resource != resources) {
            continue;
        }
        text += fmt::format(
            "<tr><th><code>{}</code></th><td class=\"path\">{}</td><td class=\"soft\">{}</td>"
            "<td class=\"soft\">{}</td></tr>\n",
            escape_html(parameter.key), escape_html(format_value(parameter, job)),
            escape_html(parameter.unit), escape_html(parameter.help));
    }
    return text;
}

std::string format_parameter_section(const Job& job) {
    return "<section id=\"parameters\"><h2>Parameters</h2>\n<div "
           "class=\"wide\"><table><tbody>\n" +
           format_parameter_rows(job, false) + "</tbody></table></div></section>\n";
}

std::string format_cost_section(const ReportPage& page) {
    const Report& report = page.report;
    std::string text =
        "<!-- knap: cost -->\n<section id=\"cost\"><h2>Cost</h2>\n<div class=\"wide\"><table "
        "class=\"figures\"><thead><tr><th>stage</th><th>time</th><th>processor "
        "time</th><th>points</th></tr></thead><tbody>\n";
    double seconds = 0;
    double cpu_seconds = 0;
    for (const StageReport& stage : report.stages) {
        text += fmt::format("<tr><th>{}</th><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                            escape_html(stage.name), format_seconds(stage.seconds),
                            format_seconds(stage.cpu_seconds), format_count(stage.points));
        seconds += stage.seconds;
        cpu_seconds += stage.cpu_seconds;
    }
    text += fmt::format(
        "<tr><th>all stages</th><td>{}</td><td>{}</td><td></td></tr>\n</tbody></table></div>\n"
        "<p class=\"soft\">Of the process that finished the job, up to the writing of this page; "
        "what an earlier, unfinished run had done is not in it.</p>\n<table><tbody>\n",
        format_seconds(seconds), format_seconds(cpu_seconds));
    text += fact("memory peak", format_bytes(report.memory_peak_bytes));
    text += fact("scratch peak", format_bytes(report.scratch_peak_bytes));
    text += fact("bricks", fmt::format("{}, {} stragglers", format_count(report.bricks),
                                       format_count(report.stragglers)));
    return text + "</tbody></table>\n<div class=\"wide\"><table><tbody>\n" +
           format_parameter_rows(page.job, true) +
           "</tbody></table></div></section>\n<!-- knap: end of cost -->\n";
}

}  // namespace knap
