"""The legends of charts that stand beside each other: what they share stands once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ..figures.figure import (
    ColourRole,
    LineSeries,
    Plot,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    ReferenceRegion,
)


@dataclass(frozen=True)
class LegendEntry:
    """What stands for a series: `mark` is "line", "dash", "point", "ring" or "area"."""

    mark: str
    role: ColourRole
    words: str


def legends_of(plots: Sequence[Plot]) -> tuple[list[LegendEntry], list[list[LegendEntry]]]:
    """The entries that several plots share, and the other entries of each plot."""
    entries = [list(_entries(plot)) for plot in plots]
    counts = Counter(entry for own in entries for entry in own)
    shared = [entry for entry, count in counts.items() if count > 1]
    return shared, [[entry for entry in own if entry not in shared] for own in entries]


def _entries(plot: Plot) -> Iterator[LegendEntry]:
    """Each name once, by the first that bears it."""
    names: set[str] = set()
    drawn: list[PlotSeries | ReferenceLine | ReferenceRegion] = [
        *plot.series,
        *plot.reference_lines,
        *plot.regions,
    ]
    for part in drawn:
        if part.name and part.name not in names:
            names.add(part.name)
            yield LegendEntry(_mark(part), part.role, part.name)


def _mark(part: PlotSeries | ReferenceLine | ReferenceRegion) -> str:
    match part:
        case PointSeries():
            return "point" if part.filled else "ring"
        case LineSeries() | ReferenceLine():
            return "line" if part.dash == "solid" else "dash"
    return "area"
