"""The series of a figure, for tests that know of which kind each is."""

from __future__ import annotations

from typing import Any

from pyroshock.app.figures.figure import Plot


def series_of(plot: Plot) -> list[Any]:
    """All series; each kind has fields of its own."""
    return list(plot.series)


def named_series(plot: Plot) -> dict[str, Any]:
    """By their entry of the legend, the last of a name."""
    return {own.name: own for own in plot.series}
