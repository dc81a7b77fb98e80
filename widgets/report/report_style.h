#pragma once

namespace fieldtrue::widgets {

/// The report's style sheet: light and dark by the reader's system, and a form for paper. Holds no '<', '>' or '&'.
inline constexpr const char* kReportStyle = R"(
:root { color-scheme: light dark; --page: #ffffff; --text: #1c2127; --muted: #5b6671; --line: #d5dae0; --panel: #f4f6f8;
  --accent: #0b5fa5; --attention: #8a5a00; }
@media (prefers-color-scheme: dark) { :root { --page: #15191e; --text: #e6eaee; --muted: #9aa6b2; --line: #343c45;
  --panel: #1e242b; --accent: #6db3f2; --attention: #e8b04a; } }
* { box-sizing: border-box; }
body { overflow-wrap: break-word; margin: 0 auto; max-width: 1160px; padding: 24px; background: var(--page); color: var(--text);
  font: 16px/1.5 system-ui, "Noto Sans", "DejaVu Sans", sans-serif; }
h1 { margin: 0 0 12px; font-size: 28px; line-height: 1.25; }
h2 { margin: 40px 0 12px; font-size: 20px; }
h3 { margin: 24px 0 8px; font-size: 16px; }
.verdict { margin: 0 0 16px; font-size: 20px; line-height: 1.4; font-weight: 600; }
.lead { margin: 0; color: var(--muted); }
.notice { padding: 8px 12px; border-left: 4px solid var(--attention); background: var(--panel); }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(320px, 1fr)); gap: 16px; }
figure { margin: 0; }
figure img { display: block; width: 100%; height: auto; border: 1px solid var(--line); border-radius: 4px; }
figcaption { padding-top: 4px; font-size: 14px; color: var(--muted); }
.wide { overflow-x: auto; }
table { width: 100%; border-collapse: collapse; font-size: 14px; font-variant-numeric: tabular-nums; }
caption { padding-bottom: 4px; text-align: left; color: var(--muted); }
th, td { padding: 4px 6px; border-bottom: 1px solid var(--line); text-align: right; vertical-align: top; }
th { font-weight: 400; }
thead th { vertical-align: bottom; color: var(--muted); }
th:first-child { text-align: left; }
.number { white-space: nowrap; }
.range { min-width: 128px; }
tr.best th, tr.best td { font-weight: 700; }
tr.worse td, tr.worse th { color: var(--muted); }
tr.skipped td { text-align: left; color: var(--muted); }
tr.before { background: var(--panel); }
.mark { margin-left: 8px; font-size: 12px; color: var(--accent); font-weight: 600; }
tr.worse .mark { color: var(--attention); }
dl { display: grid; grid-template-columns: fit-content(40%) 1fr; gap: 4px 24px; margin: 0; }
dt { color: var(--muted); }
dd { margin: 0; overflow-wrap: anywhere; }
summary { margin: 12px 0; cursor: pointer; color: var(--accent); }
@page { margin: 12mm; }
@media print { :root { --page: #ffffff; --text: #000000; --muted: #444444; --line: #bbbbbb; --panel: #f2f2f2; }
  body { max-width: none; padding: 0; font-size: 11pt; } h1 { font-size: 18pt; } .verdict { font-size: 13pt; }
  figure, tr, dl { break-inside: avoid; } h2, h3 { break-after: avoid; } .wide { overflow-x: visible; } table { font-size: 8pt; } th, td { padding-left: 4px; padding-right: 4px; } .range { min-width: 0; }
  .verdict, h1 { break-after: avoid; } }
)";

}  // namespace fieldtrue::widgets
