"""The thesis's figures (Tables 4.4 to 4.9, 5.2 and 5.3) under our models' names.

Its Tables 5.2 and 5.3 are of the two optimised models, `coregional-gp` and `nn-ga`, and of the analytic pulses. Where
it gives a figure twice, the first row of `data/thesis_tables.csv` counts: the optimised, more precise one. Table 4.8's
time model, tuned by Bayesian optimisation, goes with its network (section 4.4) and tells of `gp` too, behind Table
4.4's. The last three of Table 4.4 (SVM, kernel, linear: hundreds and more) stand as printed, as relative errors.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache


@dataclass(frozen=True)
class ThesisFigure:
    """A figure as printed, and the table that prints it."""

    model: str
    metric: str
    value: float
    table: str


@cache
def all_figures() -> tuple[ThesisFigure, ...]:
    """Every figure, those that count first."""
    import csv
    from importlib.resources import files

    text = (files(__package__) / "data" / "thesis_tables.csv").read_text(encoding="utf-8")
    rows = list(csv.DictReader(text.splitlines()))
    return tuple(ThesisFigure(row["model"], row["metric"], float(row["value"]), row["table"]) for row in rows)


def thesis_figures(model: str) -> dict[str, ThesisFigure]:
    """By metric, what the thesis reports of a model; empty for one that it does not have."""
    figures: dict[str, ThesisFigure] = {}
    for figure in all_figures():
        if figure.model == model:
            figures.setdefault(figure.metric, figure)
    return figures
