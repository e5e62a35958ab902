"""The page of all figures: first one row for each question, then where we lose, then everything."""

from __future__ import annotations

import datetime as dt
import platform
from collections.abc import Iterable, Sequence

from .figures import Figure, table_row
from .machine import FOUNDATIONS, PEERS, machine, versions

QUICK_COMMAND, FULL_COMMAND = "make bench", "python -m benchmarks --full"

_INTRODUCTION = """
Ours and the peer take turns in one run; a ratio is ours over the peer's, turn by turn: median (least to largest). Below
1 we are ahead. Where we are not, the row says **slower**, **more** or **worse**; a promise that is broken is **lost**,
and the command's exit code is 1; an aim may be **missed**. The first call of each, with its imports and its compiling,
is not counted, except where a whole command is measured. What bounds ours is measured in the same run; the last column
is how many times that ours takes.
""".strip()
_PICTURE = (
    "Our time over each peer's, on a logarithmic axis: left of the line we are faster; bars from the least to the "
    "largest repeat."
)
_GROWTH = (
    "Growth: what more impacts, more configurations and more training pulses cost, on logarithmic axes; bars from the "
    "least to the largest repeat."
)
_SUMMARY_HEAD = ("question", "ours", "the strongest peer", "ours over the peer's", "what bounds ours", "times that")
_DETAIL_HEAD = ("figure", "ours", "peer", "ours over the peer's", "promised", "what bounds ours", "times that")


def page(figures: Sequence[Figure], command: str, minutes: float, pictures: Sequence[str] = ()) -> str:
    """Markdown. `pictures`: paths beside the page of the ratios and, where it was drawn, of the growth."""
    parts = [
        "# Benchmarks" if command == QUICK_COMMAND else "# Benchmarks at full size",
        "",
        *_preface(command, minutes),
    ]
    parts += ["", "## In short", "", *_table(_SUMMARY_HEAD, map(_answer, answers(figures)))]
    for path, text in zip(pictures, (_PICTURE, _GROWTH), strict=False):
        parts += ["", f"![{text}]({path})", "", text]
    parts += ["", "## Where we lose", "", *_losses(figures)]
    for theme in dict.fromkeys(figure.theme for figure in figures):
        rows = [figure.row() for figure in figures if figure.theme == theme]
        parts += ["", f"## {theme}", "", *_table(_DETAIL_HEAD, rows)]
    return "\n".join(parts) + "\n"


def answers(figures: Sequence[Figure]) -> list[Figure]:
    """Of each question the figure that is worst for us; one without a value only where no other has one."""
    asked = dict.fromkeys(figure.question for figure in figures if figure.question)
    return [max((f for f in figures if f.question == question), key=_badness) for question in asked]


def _badness(figure: Figure) -> float:
    return figure.over.median if figure.over else -1.0


def _answer(figure: Figure) -> str:
    peer = f"{figure.rival}: {figure.peer}" if figure.rival else figure.peer
    near = figure.near.text() if figure.near else "—"
    lost = "" if figure.holds else f"; {'promised ' if figure.binding else ''}{figure.promise}"
    return table_row(figure.question, figure.ours, peer, figure.ratio + lost, figure.nature or "—", near)


def _losses(figures: Sequence[Figure]) -> list[str]:
    lost = [figure for figure in figures if figure.behind or not figure.holds]
    if not lost:
        return ["Nowhere in this run."]
    rows = (table_row(figure.theme, figure.name, figure.ratio, figure.promise) for figure in lost)
    return _table(("of", "figure", "ours over the peer's", "promised"), rows)


def _table(head: Sequence[str], rows: Iterable[str]) -> list[str]:
    return [table_row(*head), "| --- " * len(head) + "|", *rows]


def _preface(command: str, minutes: float) -> list[str]:
    today = f"{dt.datetime.now(dt.UTC):%Y-%m-%d}"
    other = (
        "Sizes are such that all of it takes less than a quarter of an hour on two cores; "
        "[at full size](benchmarks-full.md): 180 recordings, 1,000,000 impacts, every kind of series."
        if command == QUICK_COMMAND
        else "The same questions in less than a quarter of an hour: [benchmarks.md](benchmarks.md)."
    )
    return [
        f"Written by `{command}` in {minutes:.0f} minutes. {other}",
        "",
        _INTRODUCTION,
        "",
        f"On {today}: {machine()}; Python {platform.python_version()}, {versions(FOUNDATIONS)}.",
        f"Peers: {versions(PEERS)}; QCoDeS and endaq in environments of their own.",
    ]
