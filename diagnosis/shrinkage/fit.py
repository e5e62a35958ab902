"""Effects of known kinds fitted to some of the configurations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...twin.effects import Effect
from ..evidence.coordinates import sheets
from ..evidence.surface import Surface
from ..localisation.means import Floats
from ..stages.base import Stage
from .gaps import Gaps

Rows = NDArray[np.intp]
#: Standard deviation, in tolerances, that the simulator is allowed beside the scatter: else quiet observables rule.
_BACKGROUND = 0.5
#: Grid points for each surface that a pair is started from.
_STARTS = 12


@dataclass(frozen=True, eq=False)
class Fitter:
    """Least squares of effects' likely parameters. Made once for a campaign; fits of its folds simulate nothing.

    The changes of each effect are interpolated between nodes; a pair starts from the sum of both and is then simulated
    as a pair, since effects do not add up.
    """

    stages: Sequence[Stage]
    gaps: Gaps
    surfaces: tuple[tuple[Surface, ...], ...]

    @classmethod
    def of(cls, stages: Sequence[Stage], kinds: Sequence[type[Effect]]) -> Self:
        """All observables count, by tolerance and scatter. Raises `ValueError` for an effect without likely ranges."""
        found = tuple(tuple(Surface.of(sheet, stages) for sheet in sheets(kind)) for kind in kinds)
        return cls(stages, Gaps.of(stages), found)

    def fit(self, rows: Rows) -> tuple[Effect, ...]:
        """On configurations `rows` of the record; () without kinds."""
        if not self.surfaces:
            return ()
        fits = [self._fitted(each, rows) for each in product(*self.surfaces)]
        return min(fits, key=lambda each: each[0])[1]

    def _fitted(self, surfaces: Sequence[Surface], rows: Rows) -> tuple[float, tuple[Effect, ...]]:
        target = _Target.of(self.gaps, rows)
        start = _start(surfaces, target)
        u, cost = _least_squares(lambda v: target.residual(_summed(surfaces, v)), start)
        if len(surfaces) > 1:
            u, cost = _least_squares(lambda v: target.residual(self._changed(surfaces, v)), u, step=0.02)
        return cost, tuple(s.effect(v) for s, v in _parts(surfaces, u))

    def _changed(self, surfaces: Sequence[Surface], u: Floats) -> Floats:
        effects = [s.effect(v) for s, v in _parts(surfaces, u)]
        shown = [[e for e in effects if e.id in stage.shows] for stage in self.stages]
        tables = [stage.changes([each])[0] for stage, each in zip(self.stages, shown, strict=True)]
        return np.concatenate(tables, axis=1)


def fit(stages: Sequence[Stage], kinds: Sequence[type[Effect]], rows: Rows) -> tuple[Effect, ...]:
    """Effects of these kinds that explain the gap of configurations `rows` best. Several folds: use a `Fitter`."""
    return Fitter.of(stages, kinds).fit(rows)


@dataclass(frozen=True, eq=False)
class _Target:
    """What is to be explained: (rows, D) over the weight, in the scale's unit."""

    gap: Floats
    weight: Floats
    scale: Floats
    rows: Rows

    @classmethod
    def of(cls, gaps: Gaps, rows: Rows) -> Self:
        weight = np.where(np.isfinite(gaps.mean), 1 / np.sqrt(gaps.variance + _BACKGROUND**2), 0.0)[rows]
        return cls(np.nan_to_num(gaps.mean)[rows], np.nan_to_num(weight), gaps.scale, rows)

    def residual(self, change: Floats) -> Floats:
        """Flat, from a change (C, D') of all observables in their units."""
        used = np.isfinite(self.scale)
        moved = change[self.rows][:, used] / self.scale[used]
        return np.asarray(((self.gap - np.nan_to_num(moved)) * self.weight).ravel())


def _start(surfaces: Sequence[Surface], target: _Target) -> Floats:
    """The best point of the surfaces' own grids."""
    choices = [_thinned(s, None if len(surfaces) == 1 else _STARTS) for s in surfaces]
    changes = [[s.change(u) for u in points] for s, points in zip(surfaces, choices, strict=True)]
    best, place = np.inf, np.concatenate([points[0] for points in choices])
    for at in product(*(range(len(points)) for points in choices)):
        together = np.sum([c[i] for c, i in zip(changes, at, strict=True)], axis=0)
        cost = float((target.residual(together) ** 2).sum())
        if cost < best:
            best, place = cost, np.concatenate([p[i] for p, i in zip(choices, at, strict=True)])
    return place


def _thinned(surface: Surface, most: int | None) -> Floats:
    points = surface.points[surface.valid]
    most = 64 if most is None else most
    return np.asarray(points[np.unique(np.linspace(0, len(points) - 1, most).astype(int))])


def _summed(surfaces: Sequence[Surface], u: Floats) -> Floats:
    return np.asarray(np.sum([s.change(v) for s, v in _parts(surfaces, u)], axis=0))


def _parts(surfaces: Sequence[Surface], u: Floats) -> list[tuple[Surface, Floats]]:
    ends = np.cumsum([len(s.sheet.axes) for s in surfaces])[:-1]
    return list(zip(surfaces, np.split(u, ends), strict=True))


def _least_squares(residual: Callable[[Floats], Floats], start: Floats, step: float = 1e-4) -> tuple[Floats, float]:
    from scipy.optimize import least_squares

    inside = np.clip(start, 1e-6, 1 - 1e-6)
    found = least_squares(residual, inside, bounds=(0.0, 1.0), diff_step=np.array([step]), max_nfev=40)
    return found.x, float(found.cost)
