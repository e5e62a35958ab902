"""The colours of marks, once for screen and paper: series that colour-blind readers tell apart, light and dark.

A page gives a mark its colour by the class that `svg` and `curves` write; a PDF looks the same class up here.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

from .style import STYLE

#: Okabe and Ito's palette without its yellow, and a brighter one of the same order for a dark page.
_LIGHT = ("#0072b2", "#c75000", "#00805c", "#b3508c", "#2f8fc4", "#a87400", "#5b4fb5", "#4d5966")
_DARK = ("#56a9e0", "#f08a4b", "#35c497", "#e08fc0", "#8fd0f5", "#e6b23c", "#a9a0f0", "#b4bfca")

#: Series that have a colour of their own; further ones begin anew.
SERIES = len(_LIGHT)


@dataclass(frozen=True)
class Ink:
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
def inks() -> dict[str, Ink]:
    """The ink of each class of mark, on paper."""
    colour = light()
    marks = {
        "grid": Ink(colour["rule"]),
        "zero": Ink(colour["quiet"]),
        "tolerance": Ink(colour["quiet"], dash=(4, 3)),
        "floor": Ink(fill=colour["floor"]),
        "before": Ink(colour["before"], width=2),
        "after": Ink(fill=colour["after"]),
        "before-line": Ink(colour["before"], width=2, dash=(5, 3)),
        "after-line": Ink(colour["after"], width=2),
        "measured-line": Ink(colour["ink"], width=1.4),
        "bar-error": Ink(fill=colour["before"]),
        "bar-gone": Ink(fill=colour["bar"]),
        "bar-named": Ink(fill=colour["bar"]),
        "bar-other": Ink(fill=colour["other"]),
        "interval": Ink(colour["ink"], width=1.6),
        "tick": Ink(fill=colour["quiet"]),
        "axis": Ink(fill=colour["ink"]),
    }
    for i in range(SERIES):
        marks[f"line-{i}"] = Ink(colour[f"s{i}"], width=1.6)
        marks[f"dot-{i}"] = Ink(fill=colour[f"s{i}"], opacity=0.8)
        marks[f"spread-{i}"] = Ink(fill=colour[f"s{i}"], opacity=0.15)
    return marks


def css() -> str:
    """The series' colours and what else a report needs beyond the style of all pages."""
    rules = [
        f":root {{ {_variables(_LIGHT)} }}",
        f"@media (prefers-color-scheme: dark) {{ :root {{ {_variables(_DARK)} }} }}",
    ]
    for i in range(SERIES):
        rules.append(
            f".line-{i} {{ stroke: var(--s{i}); stroke-width: 1.6; }} i.key-line-{i} {{ background: var(--s{i});"
        )
        rules[-1] += " height: 0.25rem; border-radius: 0.1rem; }"
        rules.append(f".dot-{i} {{ fill: var(--s{i}); opacity: 0.8; }} .key-dot-{i} {{ background: var(--s{i}); }}")
        rules.append(f"polygon.spread-{i} {{ fill: var(--s{i}); opacity: 0.15; }}")
    paper = "; ".join(f"--{name}: {colour}" for name, colour in light().items())
    return "\n".join(
        [*rules, _LAYOUT, f"@media print {{ :root {{ color-scheme: light; {paper}; --page: #ffffff; }} }}", ""]
    )


def _variables(colours: tuple[str, ...]) -> str:
    return " ".join(f"--s{i}: {colour};" for i, colour in enumerate(colours))


_LAYOUT = """dl { display: grid; grid-template-columns: max-content 1fr; gap: 0.15rem 1rem; margin: 0.8rem 0; }
dt { color: var(--quiet); } dd { margin: 0; }
.kind { color: var(--quiet); text-transform: uppercase; letter-spacing: 0.06em; font-size: 0.8rem; margin: 0; }
.scroll { margin: 0.6rem 0; } .scroll:focus-visible { outline: 2px solid var(--bar); outline-offset: 2px; }
caption { text-align: left; color: var(--quiet); font-size: 0.875rem; padding-bottom: 0.3rem; }
th, td { overflow-wrap: break-word; } th { vertical-align: bottom; } td { vertical-align: top; }
td.num, th.num { text-align: right; font-variant-numeric: tabular-nums; } td.num { white-space: nowrap; }
.charts { margin: 0.6rem 0; } figure .keys { margin: 0.3rem 0 0; }
.charts.one { grid-template-columns: minmax(0, 36rem); }
@media print { @page { margin: 15mm; } body { padding: 0; font-size: 10pt; } table { font-size: 7.5pt; }
  .scroll { overflow: visible; }
  .charts:not(.one) { grid-template-columns: 1fr 1fr; } h2 { break-after: avoid; } tr, .row { break-inside: avoid; }
  thead { display: table-header-group; } * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }"""
