"""The style sheet of a report: one column, system fonts, light or dark as the reader's device, plain on paper."""

CSS = """
:root { color-scheme: light dark;
  --text: #1b1b1b; --soft: #5a5a5a; --back: #ffffff; --line: #d8d8d8; --shade: #00000030; --tint: #0000000d;
  --mark: #0072b2; }
@media (prefers-color-scheme: dark) { :root {
  --text: #e6e6e6; --soft: #a8a8a8; --back: #17191c; --line: #3a3d42; --shade: #ffffff38; --tint: #ffffff1a;
  --mark: #56b4e9; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--back); color: var(--text);
  font: 1rem/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", "DejaVu Sans", sans-serif; }
main { max-width: 46rem; margin: 0 auto; padding: 2rem 1rem 3rem; }
h1 { font-size: 1.7rem; line-height: 1.25; margin: 0 0 1rem; overflow-wrap: break-word; }
h2 { font-size: 1.25rem; line-height: 1.3; margin: 2.5rem 0 0.75rem; padding-top: 1rem;
  border-top: 1px solid var(--line); overflow-wrap: break-word; }
p { margin: 0 0 1rem; overflow-wrap: break-word; }
.lead { font-size: 1.15rem; border-left: 4px solid var(--mark); padding: 0.1rem 0 0.1rem 0.9rem; }
figure { margin: 1.25rem 0 1.5rem; }
figcaption { color: var(--soft); font-size: 0.9rem; margin: 0.4rem 0; }
.wide { overflow-x: auto; }
pre { overflow-x: auto; }
p code, figcaption code { font: 0.9em ui-monospace, "Liberation Mono", "DejaVu Sans Mono", monospace;
  background: var(--tint); padding: 0.05em 0.25em; border-radius: 3px; overflow-wrap: break-word; }
.wide, pre { background: linear-gradient(to right, var(--back) 1rem, transparent 2rem) local,
    linear-gradient(to left, var(--back) 1rem, transparent 2rem) local,
    linear-gradient(to right, var(--shade), transparent 0.8rem),
    linear-gradient(to left, var(--shade), transparent 0.8rem); }
details { margin: 0; }
summary { cursor: pointer; }
summary h2 { display: inline; border: none; margin: 0; padding: 0; }
details > summary { border-top: 1px solid var(--line); margin: 2.5rem 0 0.75rem; padding-top: 1rem; }
.white { --back: #ffffff; --shade: #00000030; border: 1px solid var(--line); border-radius: 4px; padding: 0.5rem; }
.white img { mix-blend-mode: multiply; }
img { display: block; margin: 0 auto; max-width: 100%; height: auto; }
table { border-collapse: collapse; font-size: 0.92rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 0.3rem 1.2rem 0.3rem 0; border-bottom: 1px solid var(--line);
  vertical-align: baseline; }
th { font-weight: 600; border-bottom: 1.5px solid var(--soft); vertical-align: bottom; }
th[title] { cursor: help; text-decoration: underline dotted var(--soft) 1px; text-underline-offset: 0.25em; }
td { min-width: 5.5rem; }
.number { text-align: right; min-width: 0; }
td.number { white-space: nowrap; }
pre { border: 1px solid var(--line); border-radius: 4px; padding: 0.7rem 0.9rem; margin: 0;
  font: 0.85rem/1.45 ui-monospace, "Liberation Mono", "DejaVu Sans Mono", monospace; }
footer { color: var(--soft); font-size: 0.85rem; margin-top: 3rem; padding-top: 0.75rem;
  border-top: 1px solid var(--line); overflow-wrap: break-word; }
@media screen and (max-width: 34rem) {
  table { font-size: 0.84rem; }
  th, td { padding-right: 0.55rem; }
  td { min-width: 0; }
  .white img:not(.fits) { max-width: none; width: 30rem; }
}
@media print {
  :root { --text: #000000; --soft: #404040; --back: #ffffff; --line: #b0b0b0; --shade: transparent; --mark: #000000; }
  @page { margin: 18mm 16mm; }
  body { font-size: 10pt; }
  main { max-width: none; padding: 0; }
  h2 { break-after: avoid; }
  figure, tr, pre { break-inside: avoid; }
  thead { display: table-header-group; }
  figure:has(table) { break-inside: auto; }
  .wide { overflow: visible; }
  .white { border: none; padding: 0; }
  img { max-width: 100%; margin: 0; }
  pre { white-space: pre-wrap; }
}
"""
