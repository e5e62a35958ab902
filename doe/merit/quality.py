"""All figures by which a design is judged, and two designs side by side.

What a two-level design cannot tell apart: main effects and interactions of two factors that go
together.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..order import changeovers
from ..space import Space
from . import space_filling
from .model_terms import axis_words
from .space_filling import centres

Sense = Literal["less", "more", "neither"]


@dataclass(frozen=True)
class Quality:
    """Figures of one design; deviations are counts minus balanced shares, in runs.

    Balance and correlation take a continuous factor by the `doe.space.STRATA` parts of its range,
    spread and distance by its values, and D-efficiency by its linear effect.
    """

    runs: int  #: of the design
    distinct: int  #: different treatments among them
    level_counts: Mapping[str, Mapping[str, int]]  #: axis to level to runs
    worst_level: float  #: largest deviation of a level
    worst_pair: float  #: of a cell of two axes
    worst_triple: float  #: of a cell of three axes
    rms_triple: float  #: root of the mean square over all cells of three axes
    uneven_triples: int  #: cells of three axes a whole run or more off their share
    centred_discrepancy: float  #: squared, as in `scipy.stats.qmc`
    wrap_around_discrepancy: float  #: likewise
    minimum_distance: float  #: in the unit cube; 0 with repeats, infinite for one run
    fewest_differences: int  #: axes in which the two most similar runs differ
    largest_correlation: float  #: canonical, between two axes
    d_efficiency: float  #: main effects, those of levels in effect coding
    d_efficiency_limit: float  #: what a balanced orthogonal design would have
    changeovers: Mapping[str, int]  #: factor to the times it is changed, in the order given


def quality(space: Space, treatments: NDArray[np.int64]) -> Quality:
    """The quality of a design.

    Parameters:
        space: What the campaign varies.
        treatments: Treatments of the space, of shape `(n, axes)`, in order of run.

    Raises:
        ValueError: Where there is no run, and for rows that are no treatments of the space.
    """
    rows = space.checked(treatments)
    if not len(rows):
        raise ValueError("treatments: no run; expected at least one")
    cells, points = space.in_strata(rows), centres(space, rows)
    sizes = [axis.strata for axis in space.axes]
    values = [axis.size for axis in space.axes]
    linear = [index for index, axis in enumerate(space.axes) if axis.continuous]
    return Quality(
        runs=len(rows),
        distinct=space_filling.distinct(rows),
        level_counts=_level_counts(space.stratified, cells),
        worst_level=space_filling.worst_deviation(cells, sizes, 1),
        worst_pair=space_filling.worst_deviation(cells, sizes, 2),
        worst_triple=space_filling.worst_deviation(cells, sizes, 3),
        rms_triple=space_filling.rms_deviation(cells, sizes, 3),
        uneven_triples=space_filling.beyond_one(cells, sizes, 3),
        centred_discrepancy=space_filling.discrepancy(points, "CD"),
        wrap_around_discrepancy=space_filling.discrepancy(points, "WD"),
        minimum_distance=space_filling.minimum_distance(points),
        fewest_differences=space_filling.fewest_differences(rows),
        largest_correlation=space_filling.largest_correlation(cells, sizes),
        d_efficiency=space_filling.d_efficiency(rows, values, linear),
        d_efficiency_limit=space_filling.d_efficiency_limit(values, linear),
        changeovers=changeovers(space, rows),
    )


def _level_counts(space: Space, rows: NDArray[np.int64]) -> dict[str, dict[str, int]]:
    counts = [
        np.bincount(rows[:, index], minlength=axis.size) for index, axis in enumerate(space.axes)
    ]
    return {
        axis.name: dict(zip(axis.labels, axis_counts.tolist(), strict=True))
        for axis, axis_counts in zip(space.axes, counts, strict=True)
    }


#: Figure, its words, and what is better.
FIGURES: dict[str, tuple[str, Sense]] = {
    "runs": ("runs", "neither"),
    "distinct": ("distinct treatments", "more"),
    "worst_level": ("worst level from its share", "less"),
    "worst_pair": ("worst pair from its share", "less"),
    "worst_triple": ("worst triple from its share", "less"),
    "rms_triple": ("triples from their share, rms", "less"),
    "uneven_triples": ("triples a run or more off", "less"),
    "centred_discrepancy": ("centred discrepancy", "less"),
    "wrap_around_discrepancy": ("wrap-around discrepancy", "less"),
    "minimum_distance": ("minimum distance", "more"),
    "fewest_differences": ("fewest differing axes", "more"),
    "largest_correlation": ("largest correlation", "less"),
    "d_efficiency": ("D-efficiency", "more"),
}


@dataclass(frozen=True)
class FigureComparison:
    """One figure of two designs as text, and which is better to the digits shown: "a", "b" or
    neither ("")."""

    figure: str
    a: str
    b: str
    better: Literal["a", "b", ""]


def compare(a: Quality, b: Quality) -> list[FigureComparison]:
    """All figures side by side, for printing: those of `FIGURES`, then changeovers by factor.

    A factor that only one of the designs has is left blank for the other.

    Parameters:
        a: The figures of one design.
        b: The figures of the other design.
    """
    rows = [
        _row(words, sense, getattr(a, name), getattr(b, name))
        for name, (words, sense) in FIGURES.items()
    ]
    factors = dict.fromkeys([*a.changeovers, *b.changeovers])
    changed = [
        (f"changeovers, {name}", a.changeovers.get(name), b.changeovers.get(name))
        for name in factors
    ]
    return rows + [_row(words, "less", of_a, of_b) for words, of_a, of_b in changed]


def _row(words: str, sense: Sense, a: float | None, b: float | None) -> FigureComparison:
    texts = figure_text(a), figure_text(b)
    if a is None or b is None or sense == "neither" or texts[0] == texts[1]:
        return FigureComparison(words, *texts, "")
    return FigureComparison(words, *texts, "a" if (a < b) == (sense == "less") else "b")


def figure_text(value: float | None) -> str:
    """A figure as text: whole numbers as they are, others to four digits.

    Parameters:
        value: The figure; None gives an empty text.
    """
    return "" if value is None else str(value) if isinstance(value, int) else f"{value:.4g}"


#: Beyond, a table of aliases is read by nobody.
_MOST_AXES, _MOST_RUNS = 40, 20_000
_DIGITS = 1e-9


@dataclass(frozen=True)
class Alias:
    """Two effects, interactions written "a*b", and the correlation of their columns: 1 or -1 if one
    hides the other."""

    effect: str
    other: str
    correlation: float

    @property
    def full(self) -> bool:
        return abs(self.correlation) > 1 - _DIGITS


def aliases(space: Space, treatments: NDArray[np.int64]) -> tuple[Alias, ...]:
    """Main effects with each other and with two-factor interactions, and these with each other,
    that correlate.

    Parameters:
        space: What the campaign varies.
        treatments: Treatments of the space, of shape `(n, axes)`.

    Returns:
        The pairs of effects, the strongest correlation first. Empty for a design that has an axis
        at three levels or more, more than 40 axes, or more than 20,000 runs.

    Raises:
        ValueError: As `Space.checked` raises it.

    Source:
        Box, Hunter and Hunter, chapter 6; pyDOE3's `fracfact_aliasing` gives the same groups, but
        neither opposite signs nor parts.
    """
    rows = space.checked(treatments)
    used = [np.unique(rows[:, index]) for index in range(rows.shape[1])]
    varied = [index for index, levels in enumerate(used) if len(levels) > 1]
    if (
        len(rows) > _MOST_RUNS
        or not 1 < len(varied) <= _MOST_AXES
        or any(len(used[index]) > 2 for index in varied)
    ):
        return ()
    signs = np.stack(
        [np.where(rows[:, index] == used[index][1], 1.0, -1.0) for index in varied], axis=1
    )
    pairs = list(itertools.combinations(range(len(varied)), 2))
    effects = np.hstack([signs, np.stack([signs[:, a] * signs[:, b] for a, b in pairs], axis=1)])
    names = [axis_words(space.axes[index].name) for index in varied]
    words = [*names, *(f"{names[a]}*{names[b]}" for a, b in pairs)]
    cosines = effects.T @ effects / len(rows)  # of columns of 1 and -1
    first, second = np.nonzero(np.triu(np.abs(cosines) > _DIGITS, 1))
    aliases = (
        Alias(words[a], words[b], float(cosines[a, b])) for a, b in zip(first, second, strict=True)
    )
    return tuple(sorted(aliases, key=lambda alias: -abs(alias.correlation)))


def alias_lines(confounded: tuple[Alias, ...]) -> list[str]:
    """Aliases as a person reads them: a line for each group that is one, and one for what is
    aliased in part.

    Parameters:
        confounded: Pairs of effects that correlate, as `aliases` gives them.
    """
    groups: dict[str, list[str]] = {}
    for alias in confounded:
        if alias.full:
            groups.setdefault(alias.effect, []).append(
                f"{'-' if alias.correlation < 0 else ''}{alias.other}"
            )
    listed = {other.lstrip("-") for others in groups.values() for other in others}
    lines = [
        " = ".join([effect, *others]) for effect, others in groups.items() if effect not in listed
    ]
    part = [abs(alias.correlation) for alias in confounded if not alias.full]
    if part:
        lines.append(f"{len(part)} pairs of effects are aliased in part, by up to {max(part):.2f}")
    return lines
