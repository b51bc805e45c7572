#include <string_view>

#include "report/report_page.hpp"

namespace knap {

std::string_view report_style() {
    return R"(
:root { --ink: #1d2126; --soft: #5b6570; --line: #dfe3e8; --paper: #f6f7f8; --all: #9aa7b4; --kept: #c8432b; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", sans-serif; }
main { max-width: 1240px; margin: 0 auto; padding: 36px 28px 64px; }
h1 { font-size: 26px; margin: 0 0 2px; overflow-wrap: anywhere; }
h2 { font-size: 18px; margin: 0 0 12px; }
h3 { font-size: 14px; margin: 0 0 6px; }
p { margin: 0 0 12px; max-width: 78ch; }
.soft, figcaption, .none { color: var(--soft); font-size: 13px; }
section { background: #fff; border: 1px solid var(--line); border-radius: 8px; padding: 20px 22px; margin-top: 18px; }
.key { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 14px; margin-top: 18px; }
.key div { background: #fff; border: 1px solid var(--line); border-radius: 8px; padding: 12px 16px; }
.key b { display: block; font-size: 22px; font-weight: 600; font-variant-numeric: tabular-nums; }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: 14px; margin-bottom: 16px; }
figure { margin: 0; }
figure img { display: block; width: 100%; height: auto; border-radius: 5px; background: #1e2228; }
figcaption { margin-top: 5px; }
figcaption b { color: var(--ink); font-weight: 600; }
svg { display: block; width: 100%; height: auto; }
svg text { font-size: 11.5px; fill: var(--soft); font-variant-numeric: tabular-nums; }
svg text.axis { font-size: 12.5px; fill: var(--ink); }
.grid { stroke: var(--line); stroke-width: 1; } .tick { stroke: #8b949e; stroke-width: 1; }
.all { fill: var(--all); } .kept { fill: var(--kept); }
.swatch { display: inline-block; width: 11px; height: 11px; border-radius: 2px; margin: 0 5px 0 12px; vertical-align: -1px; }
.legend { max-width: 560px; margin: 4px auto 0; }
.sum { display: flex; flex-wrap: wrap; align-items: baseline; gap: 6px 14px; font-variant-numeric: tabular-nums; }
.sum span { text-align: center; } .sum b { display: block; font-size: 19px; font-weight: 600; }
.sum i { font-style: normal; color: var(--soft); font-size: 18px; }
.bar { display: flex; height: 16px; border-radius: 4px; overflow: hidden; margin: 12px 0 0; background: var(--line); }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 13.5px; font-variant-numeric: tabular-nums; }
th { text-align: left; font-weight: 500; color: var(--soft); } thead th { border-bottom: 1px solid var(--line); }
th, td { padding: 4px 18px 4px 0; vertical-align: top; }
.figures td, .figures thead th + th { text-align: right; }
.path { overflow-wrap: anywhere; }
code { font-family: ui-monospace, "DejaVu Sans Mono", monospace; font-size: 0.92em; }
@media (max-width: 760px) { .pair { grid-template-columns: 1fr; } main { padding: 20px 12px; } }
@media print { body { background: #fff; } section, .pair { break-inside: avoid; } }
)";
}

}  // namespace knap
