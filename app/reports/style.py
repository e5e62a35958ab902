"""The look of a report: one column on a telephone, two of charts on a screen, light or dark as the reader has it."""

from __future__ import annotations

#: Names of colours, light and dark.
COLOURS = """
:root { color-scheme: light dark; --page: #fbfbf9; --card: #ffffff; --ink: #1c2430; --quiet: #5a6573; --rule: #d9dde3;
  --before: #b3304a; --after: #1b6ca8; --floor: #b9c3cf; --bar: #1b6ca8; --other: #8a94a1; }
@media (prefers-color-scheme: dark) { :root { --page: #14181d; --card: #1b2128; --ink: #e7ebef; --quiet: #a3adb9;
  --rule: #343c46; --before: #f0798e; --after: #74b4e8; --floor: #465361; --bar: #4f9bd6; --other: #77828f; } }
"""
_BODY = """* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1rem; max-width: 60rem; background: var(--page); color: var(--ink);
  font: 16px/1.5 system-ui, sans-serif; overflow-wrap: anywhere; }
h1 { font-size: 1.3rem; line-height: 1.35; margin: 0.5rem 0; }
h2 { font-size: 1.05rem; margin: 1.8rem 0 0.5rem; }
h3 { font-size: 0.95rem; margin: 0 0 0.3rem; }
p, ul, ol { margin: 0.4rem 0; } ul, ol { padding-left: 1.2rem; }
.quiet, footer { color: var(--quiet); font-size: 0.875rem; }
"""
#: What a report is made of: bars, charts, tables.
PARTS = """.rows { display: grid; gap: 0.6rem; }
.row { display: grid; grid-template-columns: minmax(0, 1fr) auto; gap: 0.1rem 0.8rem; align-items: baseline; }
.row .track { grid-column: 1 / -1; height: 0.8rem; background: var(--rule); border-radius: 0.2rem; position: relative; }
.row .track i { position: absolute; top: 0; bottom: 0; min-width: 2px; background: var(--bar); border-radius: 0.2rem; }
.row .track i.other { background: var(--other); } .row .track i.floor { background: var(--floor); }
.row .value { font-variant-numeric: tabular-nums; }
.row .about { grid-column: 1 / -1; }
.charts { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(20rem, 100%), 1fr)); gap: 0.8rem; }
figure { margin: 0; padding: 0.7rem; background: var(--card); border: 1px solid var(--rule); border-radius: 0.4rem; }
svg { display: block; width: 100%; height: auto; }
svg text { fill: var(--quiet); font: 11px system-ui, sans-serif; } svg text.axis { fill: var(--ink); }
.grid { stroke: var(--rule); stroke-width: 1; } .zero { stroke: var(--quiet); stroke-width: 1; }
.tolerance { stroke: var(--quiet); stroke-width: 1; stroke-dasharray: 4 3; } polygon.floor { fill: var(--floor); }
circle.before { fill: none; stroke: var(--before); stroke-width: 2; } circle.after { fill: var(--after); }
polygon.bar-error { fill: var(--before); } polygon.bar-gone, polygon.bar-named { fill: var(--bar); }
polygon.bar-other { fill: var(--other); } .interval { stroke: var(--ink); stroke-width: 1.6; }
polyline { fill: none; stroke-width: 2; } .before-line { stroke: var(--before); stroke-dasharray: 5 3; }
.after-line { stroke: var(--after); } .measured-line { stroke: var(--ink); stroke-width: 1.4; }
.key { display: inline-flex; vertical-align: middle; align-items: center; gap: 0.4rem; margin-right: 1rem;
  font-size: 0.875rem; }
.key i { width: 0.9rem; height: 0.9rem; border-radius: 50%; }
.key-before { border: 2px solid var(--before); } .key-after { background: var(--after); }
.key-measured { background: var(--ink); } i.key-floor { background: var(--floor); border-radius: 0.15rem; }
i.key-tolerance { height: 0; border-top: 2px dashed var(--quiet); border-radius: 0; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; font-size: 0.9rem; }
th, td { text-align: left; padding: 0.25rem 0.8rem 0.25rem 0; border-bottom: 1px solid var(--rule); }
"""
STYLE = f"""{COLOURS}{_BODY}{PARTS}@media print {{ body {{ max-width: none; }} figure {{ break-inside: avoid; }} }}
"""
