"""Charts of a plan: balance of its levels, and how its runs go through them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..table_format import cell, heading
from .base import COLOURS, Figure, bars, categories


def balance_figure(axis: Mapping[str, Any]) -> Figure:
    """Runs of each level of one axis (`plan_quality.plan_page`), beside the balanced share."""
    levels = [str(level["level"]) for level in axis["levels"]]
    shown = [bars(levels, [level["runs"] for level in axis["levels"]], "runs")]
    share = axis["share"]
    level = {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": share, "y1": share}
    rule = {**level, "line": {"color": "quiet", "dash": "dash"}}
    return categories(shown, axis["axis"].replace("_", " "), "runs", shapes=[rule], showlegend=False)


def coverage_figure(levels: Sequence[Mapping[str, Any]], factor: str) -> Figure:
    """Planned, done and discarded runs of each level of one factor (`coverage.level_coverage`)."""
    factor_levels = [row for row in levels if row["factor"] == factor]
    names = [cell(factor, row["level"]) for row in factor_levels]
    states = (("done", COLOURS[2]), ("planned", COLOURS[7]), ("discarded", COLOURS[1]))
    shown = [bars(names, [row[state] for row in factor_levels], state, colour) for state, colour in states]
    return categories(shown, heading(factor), "runs", barmode="stack")
