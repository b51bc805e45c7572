#include "report/log_bars.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/format.hpp"
#include "report/html.hpp"

namespace knap {

namespace {

// Of all points, those on each side that may be put into the outermost bar.
constexpr double kTail = 0.0005;

constexpr double kWidth = 640;
constexpr double kHeight = 300;
constexpr double kLeft = 46;
constexpr double kRight = 628;
constexpr double kTop = 14;
constexpr double kBottom = 246;

/// The places of the first and the last bar.
struct Ends {
    int first = 0;
    int last = 0;
};

Ends ends_of(const std::map<int, LogBars::Bar>& bars) {
    std::uint64_t all = 0;
    for (const auto& [place, bar] : bars) {
        all += bar.all;
    }
    const double tail = kTail * static_cast<double>(all);
    Ends ends{bars.begin()->first, bars.rbegin()->first};
    const auto first_past_tail = [&](auto begin, auto end) {
        double before = 0;
        return std::find_if(begin, end, [&](const auto& entry) {
            before += static_cast<double>(entry.second.all);
            return before > tail;
        });
    };
    const auto first = first_past_tail(bars.begin(), bars.end());
    const auto last = first_past_tail(bars.rbegin(), bars.rend());
    if (first != bars.end() && last != bars.rend()) {
        ends = {first->first, last->first};
    }
    return ends;
}

/// The scales of a chart.
class Axes {
  public:
    explicit Axes(const LogBars& bars) : bars_(bars) {
        for (const LogBars::Bar& bar : bars.bars) {
            all_ += bar.all;
            kept_ += bar.kept;
        }
        all_ += bars.outside.all;
        kept_ += bars.outside.kept;
        for (const LogBars::Bar& bar : bars.bars) {
            top_ = std::max({top_, share(bar.all, all_), share(bar.kept, kept_)});
        }
        top_ *= 1.05;
    }

    double all_share(const LogBars::Bar& bar) const { return share(bar.all, all_); }
    double kept_share(const LogBars::Bar& bar) const { return share(bar.kept, kept_); }
    double top() const { return top_; }

    double x(double value) const {
        const double low = std::log(bars_.bars.front().from);
        const double high = std::log(bars_.bars.back().to);
        return kLeft + (kRight - kLeft) * (std::log(value) - low) / (high - low);
    }
    double y(double share) const { return kBottom - (kBottom - kTop) * share / top_; }

  private:
    static double share(std::uint64_t part, std::uint64_t whole) {
        return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
    }

    const LogBars& bars_;
    std::uint64_t all_ = 0;
    std::uint64_t kept_ = 0;
    double top_ = 1e-9;
};

std::string format_bar(const Axes& axes, const LogBars::Bar& bar) {
    const double left = axes.x(bar.from);
    const double width = axes.x(bar.to) - left;
    const auto rect = [&](const char* kind, double share, double inset) {
        return fmt::format(
            R"(<rect class="{}" x="{:.2f}" y="{:.2f}" width="{:.2f}" height="{:.2f}"/>)", kind,
            left + inset, axes.y(share), std::max(width - 2 * inset, 0.5), kBottom - axes.y(share));
    };
    return fmt::format(
        "<g><title>{:.3g} to {:.3g}: {} of all points ({:.2f} %), {} of the kept "
        "ones ({:.2f} %)</title>{}{}</g>\n",
        bar.from, bar.to, format_count(bar.all), 100 * axes.all_share(bar), format_count(bar.kept),
        100 * axes.kept_share(bar), rect("all", axes.all_share(bar), 0.5),
        rect("kept", axes.kept_share(bar), width * 0.28));
}

std::string format_share_axis(const Axes& axes) {
    constexpr double kMostLines = 6;
    double step = 0.0001;
    for (int i = 0; axes.top() / step > kMostLines; ++i) {
        step *= i % 3 == 1 ? 2.5 : 2;
    }
    std::string text;
    for (int i = 0; i * step <= axes.top(); ++i) {
        const double y = axes.y(i * step);
        text += fmt::format(
            "<line class=\"grid\" x1=\"{0}\" x2=\"{1}\" y1=\"{2:.2f}\" y2=\"{2:.2f}\"/>"
            "<text x=\"{3}\" y=\"{4:.2f}\" text-anchor=\"end\">{5:g} %</text>\n",
            kLeft, kRight, y, kLeft - 6, y + 4, 100 * i * step);
    }
    return text;
}

std::string format_quantity_axis(const Axes& axes, const LogBars& bars) {
    const double low = bars.bars.front().from;
    const double high = bars.bars.back().to;
    const bool is_wide = high / low > 2000;
    std::string text;
    const int first = static_cast<int>(std::floor(std::log10(low)));
    for (int decade = first; std::pow(10.0, decade) <= high; ++decade) {
        for (const int digit : {1, 2, 5}) {
            const double value = digit * std::pow(10.0, decade);
            if (value < low || value > high || (is_wide && digit != 1)) {
                continue;
            }
            text += fmt::format(
                "<line class=\"tick\" x1=\"{0:.2f}\" x2=\"{0:.2f}\" y1=\"{1}\" y2=\"{2}\"/>"
                "<text x=\"{0:.2f}\" y=\"{3}\" text-anchor=\"middle\">{4:g}</text>\n",
                axes.x(value), kBottom, kBottom + 5, kBottom + 20, value);
        }
    }
    return text;
}

}  // namespace

LogBars log_bars(const CurvatureScale& scale, const CurvatureHistogram& all,
                 const CurvatureHistogram& kept, const std::function<double(double)>& quantity,
                 int per_octave) {
    LogBars result;
    std::map<int, LogBars::Bar> bars;
    for (std::uint32_t code = 0; code < CurvatureScale::kCodes; ++code) {
        if (all.counts()[code] + kept.counts()[code] == 0) {
            continue;
        }
        const double value = quantity(scale.curvature_of(code));
        const bool has_place = value > 0 && std::isfinite(value);
        LogBars::Bar& bar = has_place
                                ? bars[static_cast<int>(std::floor(std::log2(value) * per_octave))]
                                : result.outside;
        bar.all += all.counts()[code];
        bar.kept += kept.counts()[code];
    }
    if (bars.empty()) {
        return result;
    }
    const Ends ends = ends_of(bars);
    const auto edge = [&](int place) { return std::exp2(static_cast<double>(place) / per_octave); };
    for (int place = ends.first; place <= ends.last; ++place) {
        result.bars.push_back({edge(place), edge(place + 1), 0, 0});
    }
    for (const auto& [place, bar] : bars) {
        LogBars::Bar& into = result.bars[static_cast<std::size_t>(
            std::clamp(place, ends.first, ends.last) - ends.first)];
        into.all += bar.all;
        into.kept += bar.kept;
    }
    return result;
}

std::string format_chart(const LogBars& bars, const ChartText& text) {
    if (bars.bars.empty()) {
        return fmt::format("<p class=\"none\">{}: no point has one.</p>\n",
                           escape_html(text.title));
    }
    const Axes axes(bars);
    std::string svg =
        fmt::format("<svg class=\"chart\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">\n",
                    kWidth, kHeight, escape_html(text.title));
    svg += format_share_axis(axes);
    for (const LogBars::Bar& bar : bars.bars) {
        svg += format_bar(axes, bar);
    }
    svg += format_quantity_axis(axes, bars);
    svg += fmt::format(
        "<line class=\"tick\" x1=\"{0}\" x2=\"{1}\" y1=\"{2}\" y2=\"{2}\"/>"
        "<text class=\"axis\" x=\"{3}\" y=\"{4}\" text-anchor=\"middle\">{5}</text>\n</svg>\n",
        kLeft, kRight, kBottom, (kLeft + kRight) / 2, kHeight - 10, escape_html(text.quantity));
    return svg;
}

}  // namespace knap
