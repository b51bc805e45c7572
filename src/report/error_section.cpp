#include "report/error_section.hpp"

#include <fmt/format.h>

#include "base/format.hpp"
#include "report/html.hpp"

namespace knap {

namespace {

constexpr std::string_view kBegin = "<!-- knap: error -->";
constexpr std::string_view kEnd = "<!-- knap: end of error -->";

std::string format_row(std::string_view name, double length, const MeasuredError& error) {
    std::string row = fmt::format("<tr><th>{}</th><td>{:.4g}</td><td>{:.3e}</td>", name, length,
                                  length / error.diagonal);
    if (error.spacing > 0) {
        row += fmt::format("<td>{:.3g}</td>", length / error.spacing);
    }
    return row + "</tr>\n";
}

std::string format_table(const MeasuredError& error) {
    std::string text = fmt::format(
        "<p>Distances of {} original points ({}) from a surface through the kept points: the "
        "triangles that each has with its neighbours.</p>\n"
        "<table class=\"figures\"><thead><tr><th></th><th>cloud units</th><th>of the "
        "diagonal</th>{}</tr></thead><tbody>\n",
        format_count(error.points), escape_html(error.original),
        error.spacing > 0 ? "<th>mean spacings</th>" : "");
    text += format_row("mean", error.mean, error);
    text += format_row("root mean square", error.rms, error);
    text += format_row("99 % are below", error.p99, error);
    text += format_row("largest", error.max, error);
    return text + "</tbody></table>\n";
}

}  // namespace

std::string format_error_section(const std::optional<MeasuredError>& error) {
    return fmt::format(
        "{}<section id=\"error\"><h2>Error</h2>\n{}</section>{}\n", kBegin,
        error ? format_table(*error)
              : "<p>Not measured. <code>knap evaluate ORIGINAL OUTPUT --report</code> measures how "
                "far the original points are from the kept ones and puts it here.</p>\n",
        kEnd);
}

std::optional<std::string> replace_error_section(std::string_view page,
                                                 const MeasuredError& error) {
    const std::size_t begin = page.find(kBegin);
    const std::size_t end = page.find(kEnd);
    if (begin == std::string_view::npos || end == std::string_view::npos || end < begin) {
        return std::nullopt;
    }
    std::string_view after = page.substr(end + kEnd.size());
    if (after.starts_with('\n')) {
        after.remove_prefix(1);
    }
    return std::string(page.substr(0, begin)) + format_error_section(error) + std::string(after);
}

}  // namespace knap
