"""The first picture of docs/measurements/benchmarks.md: our time over each peer's, with its spread."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from .figures import Figure

AHEAD, BEHIND, SAME = "#1b6ca8", "#d1495b", "#7a7a7a"


def shown(figures: Sequence[Figure]) -> list[Figure]:
    """Times beside a peer's that answer a question, by question, the strongest peer first."""
    found = [figure for figure in figures if figure.question and figure.of == "time" and figure.over]
    questions = list(dict.fromkeys(figure.question for figure in found))
    return sorted(found, key=lambda one: (questions.index(one.question), -one.over.median if one.over else 0.0))


def draw(figures: Sequence[Figure], path: Path) -> None:
    """A line for each of `shown`; blue where all repeats are faster, red where all are slower, grey between."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Canvas

    rows = shown(figures)
    canvas = Canvas(figsize=(9.5, 1.2 + 0.3 * max(len(rows), 1)), layout="constrained", dpi=110)
    FigureCanvasAgg(canvas)
    axes = canvas.subplots()
    for place, figure in enumerate(rows):
        over = figure.over
        assert over is not None
        colour = AHEAD if over.high < 1 else BEHIND if over.low > 1 else SAME
        bars = [[over.median - over.low], [over.high - over.median]]
        axes.errorbar(over.median, place, xerr=bars, fmt="o", color=colour, capsize=3, markersize=5)
        axes.annotate(
            f"{over.median:.2g}", (over.high, place), (6, 0), textcoords="offset points", va="center", fontsize=8
        )
    axes.axvline(1.0, color="black", linewidth=1)
    axes.set_xscale("log")
    axes.margins(x=0.12)
    axes.set_yticks(range(len(rows)), _labels(rows), fontsize=9)
    axes.set_ylim(max(len(rows), 1) - 0.5, -0.5)
    axes.set_xlabel("our time / the peer's: median, least and largest repeat (less is faster)")
    axes.grid(axis="x", which="both", alpha=0.25)
    for place in range(1, len(rows)):
        if rows[place].question != rows[place - 1].question:
            axes.axhline(place - 0.5, color="#cccccc", linewidth=0.8)
    path.parent.mkdir(parents=True, exist_ok=True)
    canvas.savefig(path)


def _labels(rows: Sequence[Figure]) -> list[str]:
    """The question once, beside its first peer."""
    seen: set[str] = set()
    labels = []
    for figure in rows:
        new = figure.question not in seen
        seen.add(figure.question)
        labels.append(f"{figure.question} | {figure.rival}" if new else figure.rival)
    return [label.replace("`", "") for label in labels]
