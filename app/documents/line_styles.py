"""The look of a report: one column on a telephone, two of charts on a screen, light or dark as the
reader has it; and the colours of marks, once for screen and paper.

A page gives a mark its colour by the class that `svg` writes; a PDF looks the same class up here.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

#: Names of colours, light and dark.
COLOURS = """
:root { color-scheme: light dark; --page: #fbfbf9; --card: #ffffff; --ink: #1c2430;
  --quiet: #5a6573; --rule: #d9dde3; --before: #b3304a; --after: #1b6ca8; --floor: #b9c3cf;
  --bar: #1b6ca8; --other: #8a94a1; }
@media (prefers-color-scheme: dark) { :root { --page: #14181d; --card: #1b2128; --ink: #e7ebef;
  --quiet: #a3adb9; --rule: #343c46; --before: #f0798e; --after: #74b4e8; --floor: #465361;
  --bar: #4f9bd6; --other: #77828f; } }
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
.row { display: grid; grid-template-columns: minmax(0, 1fr) auto; gap: 0.1rem 0.8rem;
  align-items: baseline; }
.row .track { grid-column: 1 / -1; height: 0.8rem; background: var(--rule); border-radius: 0.2rem;
  position: relative; }
.row .track i { position: absolute; top: 0; bottom: 0; min-width: 2px; background: var(--bar);
  border-radius: 0.2rem; }
.row .track i.other { background: var(--other); } .row .track i.floor { background: var(--floor); }
.row .value { font-variant-numeric: tabular-nums; }
.row .about { grid-column: 1 / -1; }
.charts { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(20rem, 100%), 1fr));
  gap: 0.8rem; }
figure { margin: 0; padding: 0.7rem; background: var(--card); border: 1px solid var(--rule);
  border-radius: 0.4rem; }
svg { display: block; width: 100%; height: auto; }
svg text { fill: var(--quiet); font: 11px system-ui, sans-serif; }
svg text.axis { fill: var(--ink); }
.grid { stroke: var(--rule); stroke-width: 1; } .zero { stroke: var(--quiet); stroke-width: 1; }
.tolerance { stroke: var(--quiet); stroke-width: 1; stroke-dasharray: 4 3; }
polygon.floor { fill: var(--floor); }
circle.before { fill: none; stroke: var(--before); stroke-width: 2; }
circle.after { fill: var(--after); }
polygon.bar-error { fill: var(--before); } polygon.bar-gone, polygon.bar-named { fill: var(--bar); }
polygon.bar-other { fill: var(--other); } .interval { stroke: var(--ink); stroke-width: 1.6; }
polyline { fill: none; stroke-width: 2; }
.before-line { stroke: var(--before); stroke-dasharray: 5 3; }
.after-line { stroke: var(--after); } .measured-line { stroke: var(--ink); stroke-width: 1.4; }
.key { display: inline-flex; vertical-align: middle; align-items: center; gap: 0.4rem;
  margin-right: 1rem; font-size: 0.875rem; }
.key i { width: 0.9rem; height: 0.9rem; border-radius: 50%; }
.key-before { border: 2px solid var(--before); } .key-after { background: var(--after); }
.key-measured { background: var(--ink); }
i.key-floor { background: var(--floor); border-radius: 0.15rem; }
i.key-interval { width: 0.2rem; border-radius: 0; background: var(--ink); }
i.key-tolerance { height: 0; border-top: 2px dashed var(--quiet); border-radius: 0; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; font-size: 0.9rem; }
th, td { text-align: left; padding: 0.25rem 0.6rem 0.25rem 0;
  border-bottom: 1px solid var(--rule); }
.fold label { display: none; font-size: 0.875rem; }
@supports selector(:has(:checked)) { @media screen and (max-width: 40rem) {
  .fold label { display: flex; align-items: center; gap: 0.5rem; min-height: 2.75rem; }
  .fold input { width: 1.2rem; height: 1.2rem; margin: 0; }
  .fold:not(:has(:checked)) .extra { display: none; } } }
"""
STYLE = f"""{COLOURS}{_BODY}{PARTS}
@media print {{ body {{ max-width: none; }} figure {{ break-inside: avoid; }} }}
"""


#: Okabe and Ito's palette without its yellow, and a brighter one of the same order for a dark page.
_LIGHT = ("#0072b2", "#c75000", "#00805c", "#b3508c", "#2f8fc4", "#a87400", "#5b4fb5", "#4d5966")
_DARK = ("#56a9e0", "#f08a4b", "#35c497", "#e08fc0", "#8fd0f5", "#e6b23c", "#a9a0f0", "#b4bfca")

#: Series that have a colour of their own; further ones begin anew.
SERIES = len(_LIGHT)


@dataclass(frozen=True)
class SeriesStyle:
    """How a mark is drawn: colours as #rrggbb or None, width in units of the chart."""

    stroke: str | None = None
    fill: str | None = None
    width: float = 1.0
    dash: tuple[float, ...] = ()
    opacity: float = 1.0


def series(number: int) -> int:
    """The colour of a series."""
    return number % SERIES


@cache
def light() -> dict[str, str]:
    """The colours of the light page by name, as the style has them, and the series' ("s0")."""
    of_style = dict(re.findall(r"--(\w+): (#[0-9a-f]{6})", STYLE.partition("@media")[0]))
    return of_style | {f"s{i}": colour for i, colour in enumerate(_LIGHT)}


@cache
def series_styles() -> dict[str, SeriesStyle]:
    """The ink of each class of mark, on paper."""
    colour = light()
    marks = {
        "grid": SeriesStyle(colour["rule"]),
        "zero": SeriesStyle(colour["quiet"]),
        "tolerance": SeriesStyle(colour["quiet"], dash=(4, 3)),
        "floor": SeriesStyle(fill=colour["floor"]),
        "before": SeriesStyle(colour["before"], width=2),
        "after": SeriesStyle(fill=colour["after"]),
        "before-line": SeriesStyle(colour["before"], width=2, dash=(5, 3)),
        "after-line": SeriesStyle(colour["after"], width=2),
        "measured-line": SeriesStyle(colour["ink"], width=1.4),
        "bar-error": SeriesStyle(fill=colour["before"]),
        "bar-gone": SeriesStyle(fill=colour["bar"]),
        "bar-named": SeriesStyle(fill=colour["bar"]),
        "bar-other": SeriesStyle(fill=colour["other"]),
        "interval": SeriesStyle(colour["ink"], width=1.6),
        "tick": SeriesStyle(fill=colour["quiet"]),
        "axis": SeriesStyle(fill=colour["ink"]),
    }
    for i in range(SERIES):
        marks[f"line-{i}"] = SeriesStyle(colour[f"s{i}"], width=1.6)
        marks[f"dot-{i}"] = SeriesStyle(fill=colour[f"s{i}"], opacity=0.8)
        marks[f"spread-{i}"] = SeriesStyle(fill=colour[f"s{i}"], opacity=0.15)
    return marks


def css() -> str:
    """The series' colours and what else a report needs beyond the style of all pages."""
    rules = [
        f":root {{ {_variables(_LIGHT)} }}",
        f"@media (prefers-color-scheme: dark) {{ :root {{ {_variables(_DARK)} }} }}",
    ]
    for i in range(SERIES):
        rules.append(
            f".line-{i} {{ stroke: var(--s{i}); stroke-width: 1.6; }} "
            f"i.key-line-{i} {{ background: var(--s{i});"
        )
        rules[-1] += " height: 0.25rem; border-radius: 0.1rem; }"
        rules.append(
            f".dot-{i} {{ fill: var(--s{i}); opacity: 0.8; }} .key-dot-{i} {{ "
            f"background: var(--s{i}); }}"
        )
        rules.append(f"polygon.spread-{i} {{ fill: var(--s{i}); opacity: 0.15; }}")
    paper = "; ".join(f"--{name}: {colour}" for name, colour in light().items())
    return "\n".join(
        [
            *rules,
            _LAYOUT,
            f"@media print {{ :root {{ color-scheme: light; {paper}; --page: #ffffff; }} }}",
            "",
        ]
    )


def _variables(colours: tuple[str, ...]) -> str:
    return " ".join(f"--s{i}: {colour};" for i, colour in enumerate(colours))


_LAYOUT = """dl { display: grid; grid-template-columns: fit-content(35%) 1fr; gap: 0.15rem 1rem;
  margin: 0.8rem 0; }
dt { color: var(--quiet); } dd { margin: 0; }
.kind { color: var(--quiet); text-transform: uppercase; letter-spacing: 0.06em; font-size: 0.8rem;
  margin: 0; }
.scroll { margin: 0.6rem 0; }
.scroll:focus-visible { outline: 2px solid var(--bar); outline-offset: 2px; }
caption { text-align: left; color: var(--quiet); font-size: 0.875rem; padding-bottom: 0.3rem; }
th, td { overflow-wrap: break-word; } th { vertical-align: bottom; } td { vertical-align: top; }
td.num, th.num { text-align: right; font-variant-numeric: tabular-nums; }
td.num { white-space: nowrap; }
.charts { margin: 0.6rem 0; } figure .keys { margin: 0.3rem 0 0; }
.charts.one { grid-template-columns: minmax(0, 36rem); }
@media print { @page { margin: 15mm; } body { padding: 0; font-size: 10pt; }
  table { font-size: 7.5pt; } .scroll { overflow: visible; }
  .charts:not(.one) { grid-template-columns: 1fr 1fr; } h2 { break-after: avoid; }
  tr, .row { break-inside: avoid; }
  thead { display: table-header-group; }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }"""
