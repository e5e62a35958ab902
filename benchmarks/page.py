"""The page of all figures and its two pictures: a row for each question, then what is behind, then
everything."""

from __future__ import annotations

import datetime as dt
import os
import platform
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pyroshock.app.figures.matplotlib_renderer import new_figure

from .harness import Figure, Spread, table, table_row, version_of

QUICK_COMMAND, FULL_COMMAND = "make bench", "python -m benchmarks --full"
#: What ours builds on, and the peers, by their names in the registry of packages.
FOUNDATIONS = ("numpy", "scipy", "numba", "h5py", "numcodecs", "SQLAlchemy", "psycopg", "torch")
PEERS = (
    "pyyeti", "endaq", "pyDOE3", "smt", "botorch", "gpytorch", "GPy", "scikit-learn", "qcodes",
    "pandas", "mlflow",
)  # fmt: skip
AHEAD, BEHIND, SAME = "#1b6ca8", "#d1495b", "#7a7a7a"

_INTRODUCTION = """
Our software and its peer take turns in one run. A ratio is our value over the peer's, turn by turn;
a cell gives its median and, in brackets, its least and its largest value. Below 1 we are ahead.
Where we are behind, the row says **slower**, **more** or **worse**. A broken promise is **lost**,
and the command then ends with exit code 1; an aim may be **missed**. The first call, with its
imports and its compiling, does not count, except where a whole command is measured. The same run
measures what bounds our value; the last column is our value over that bound.
""".strip()
_RATIO_CAPTION = (
    "The picture shows our time over each peer's time on a logarithmic axis. We are faster left of "
    "the line. Bars reach from the least to the largest repeat."
)
_GROWTH_CAPTION = (
    "The picture shows what more impacts, more configurations and more training pulses cost, on "
    "logarithmic axes. Bars reach from the least to the largest repeat."
)
_SUMMARY_HEAD = (
    "question",
    "ours",
    "the strongest peer",
    "ours over the peer's",
    "what bounds ours",
    "times that",
)
_DETAIL_HEAD = (
    "figure",
    "ours",
    "peer",
    "ours over the peer's",
    "promised",
    "what bounds ours",
    "times that",
)


def page(
    figures: Sequence[Figure], command: str, minutes: float, pictures: Sequence[str] = ()
) -> str:
    """Markdown. `pictures`: paths beside the page of the ratios and, where it was drawn, of the
    growth."""
    title = "# Benchmarks" if command == QUICK_COMMAND else "# Benchmarks at full size"
    parts = [title, "", *_preface(command, minutes)]
    parts += ["", "## In short", "", table(_SUMMARY_HEAD, map(_summary_row, summary(figures)))]
    for path, caption in zip(pictures, (_RATIO_CAPTION, _GROWTH_CAPTION), strict=False):
        parts += ["", f"![{caption}]({path})", "", caption]
    behind = [figure for figure in figures if figure.behind or not figure.holds]
    rows = (table_row(figure.theme, figure.name, figure.ratio, figure.promise) for figure in behind)
    list_behind = table(("theme", "figure", "ours over the peer's", "promised"), rows)
    parts += [
        "",
        "## Where we are behind",
        "",
        list_behind if behind else "We are behind nowhere in this run.",
    ]
    for theme in dict.fromkeys(figure.theme for figure in figures):
        details = [figure.row() for figure in figures if figure.theme == theme]
        parts += ["", f"## {theme}", "", table(_DETAIL_HEAD, details)]
    return "\n".join(parts) + "\n"


def summary(figures: Sequence[Figure]) -> list[Figure]:
    """For each question the figure that is worst for us; one without a value only where no other
    has one."""
    questions = dict.fromkeys(figure.question for figure in figures if figure.question)

    def badness(figure: Figure) -> float:
        return figure.value.median if figure.value else -1.0

    return [
        max((f for f in figures if f.question == question), key=badness) for question in questions
    ]


def _summary_row(figure: Figure) -> str:
    peer = f"{figure.peer_name}: {figure.peer}" if figure.peer_name else figure.peer
    lost = "" if figure.holds else f"; {'promised ' if figure.binding else ''}{figure.promise}"
    over_bound = figure.over_bound.text() if figure.over_bound else "—"
    return table_row(
        figure.question, figure.ours, peer, figure.ratio + lost, figure.bound or "—", over_bound
    )


def _preface(command: str, minutes: float) -> list[str]:
    sizes = (
        "The sizes are such that the run takes less than a quarter of an hour on two cores. "
        "[Benchmarks at full size](benchmarks-full.md) has 180 recordings, "
        "1,000,000 impacts and every kind of series."
        if command == QUICK_COMMAND
        else "[Benchmarks](benchmarks.md) answers the same questions in less than "
        "a quarter of an hour."
    )
    return [
        f"`{command}` wrote this page in {minutes:.0f} minutes. {sizes}",
        "",
        _INTRODUCTION,
        "",
        f"Date: {dt.datetime.now(dt.UTC):%Y-%m-%d}. Machine: {machine()}. "
        f"Software: Python {platform.python_version()}, {versions(FOUNDATIONS)}.",
        f"Peers: {versions(PEERS)}. QCoDeS and endaq run in environments of their own.",
    ]


def machine() -> str:
    """Processor, cores that may be used, and system."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = [f"model name: {platform.processor()}"]
    names = (line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{next(names, '') or platform.machine()}, {cores} cores, {platform.system()}"


def versions(packages: Sequence[str]) -> str:
    return ", ".join(f"{name} {version_of(name) or '(not installed)'}" for name in packages)


def drawn_figures(figures: Sequence[Figure]) -> list[Figure]:
    """Times beside a peer's that answer a question, by question, the strongest peer first."""
    times = [
        figure for figure in figures if figure.question and figure.kind == "time" and figure.value
    ]
    questions = list(dict.fromkeys(figure.question for figure in times))
    return sorted(
        times, key=lambda f: (questions.index(f.question), -f.value.median if f.value else 0.0)
    )


def draw_ratios(figures: Sequence[Figure], path: Path) -> None:
    """A line for each figure; blue where all repeats are faster, red where all are slower, grey
    between."""
    rows = drawn_figures(figures)
    canvas = new_figure(9.5, 1.2 + 0.3 * max(len(rows), 1))
    axes, labels, question = canvas.subplots(), [], ""
    for place, figure in enumerate(rows):
        over = figure.value or Spread(1, 1, 1)
        colour = AHEAD if over.high < 1 else BEHIND if over.low > 1 else SAME
        bars = [[over.median - over.low], [over.high - over.median]]
        axes.errorbar(over.median, place, xerr=bars, fmt="o", color=colour, capsize=3, markersize=5)
        at = (over.high, place)
        axes.annotate(
            f"{over.median:.2g}", at, (6, 0), textcoords="offset points", va="center", fontsize=8
        )
        first = figure.question != question  # the question stands once, beside its first peer
        if first and place:
            axes.axhline(place - 0.5, color="#cccccc", linewidth=0.8)
        question = figure.question
        labels.append(
            (f"{question} | {figure.peer_name}" if first else figure.peer_name).replace("`", "")
        )
    axes.axvline(1.0, color="black", linewidth=1)
    axes.set_xscale("log")
    axes.margins(x=0.12)
    axes.set_yticks(range(len(rows)), labels, fontsize=9)
    axes.set_ylim(max(len(rows), 1) - 0.5, -0.5)
    axes.set_xlabel("our time / the peer's: median, least and largest repeat (less is faster)")
    axes.grid(axis="x", which="both", alpha=0.25)
    path.parent.mkdir(parents=True, exist_ok=True)
    canvas.savefig(path, dpi=110)


#: Panels of the picture of growth: what the size counts, how a curve's name begins, unit, and
#: labels of the axes.
_PANELS = (
    ("impacts", "", "s", "impacts in the store", "time, s"),
    ("impacts", "", "bytes", "impacts in the store", "room, MB"),
    ("configurations", "", "s", "configurations", "time, s"),
    ("pulses", "training", "s", "pulses learned from", "time, s"),
    ("pulses", "1,000 predictions", "s", "pulses learned from", "time, s"),
)
_PANELS_ACROSS, _LEAST_RANGE = 3, 30.0


def draw_growth(points: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Points as growth.json holds them (`growth.Point`), each curve with its spread and its fitted
    exponent."""
    from matplotlib.ticker import NullFormatter

    panels = [
        (panel[3:], curves) for panel in _PANELS if (curves := _panel_curves(points, *panel[:3]))
    ]
    across, down = min(_PANELS_ACROSS, len(panels)), -(-len(panels) // _PANELS_ACROSS)
    canvas = new_figure(5.2 * across, 4.8 * down)
    for place, ((x, y), curves) in enumerate(panels, 1):
        axes = canvas.add_subplot(down, across, place)
        for name, rows in curves.items():
            _draw_curve(axes, name, rows)
        axes.set(xscale="log", yscale="log", xlabel=x, ylabel=y)
        low, high = axes.get_ylim()
        wider = max(_LEAST_RANGE / (high / low), 1.0) ** 0.5  # a constant looks constant
        axes.set_ylim(low / wider, high * wider)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_minor_formatter(NullFormatter())
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.16), frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    canvas.savefig(path, dpi=110)


def _panel_curves(
    points: Sequence[Mapping[str, Any]], axis: str, begin: str, unit: str
) -> dict[str, list[Mapping[str, Any]]]:
    curves: dict[str, list[Mapping[str, Any]]] = {}
    for point in sorted(points, key=lambda point: point["size"]):
        if (point["axis"], point["unit"]) == (axis, unit) and point["curve"].startswith(begin):
            curves.setdefault(point["curve"], []).append(point)
    return curves


def _draw_curve(axes: Any, name: str, rows: Sequence[Mapping[str, Any]]) -> None:
    factor, sizes = 1e-6 if rows[0]["unit"] == "bytes" else 1.0, [row["size"] for row in rows]
    middle = np.array([factor * np.median(row["values"]) for row in rows])
    ends = factor * np.array([[min(row["values"]), max(row["values"])] for row in rows]).T
    (line,) = axes.plot(sizes, middle, "o", markersize=4, label=name)
    axes.errorbar(
        sizes, middle, np.abs(ends - middle), fmt="none", color=line.get_color(), capsize=2
    )
    if len(rows) > 1:
        slope, level = np.polyfit(np.log(sizes), np.log(middle), 1)
        line.set_label(f"{name}: $n^{{{slope:.2f}}}$")
        axes.plot(
            sizes, np.exp(level) * np.power(sizes, slope), color=line.get_color(), linewidth=1
        )
