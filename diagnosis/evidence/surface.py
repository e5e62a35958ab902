"""How an effect moves the observables over all its likely parameters: simulated at nodes, interpolated in between."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache, reduce
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...twin.effects import Effect
from ..stages.base import Stage
from .coordinates import Sheet, sheets

Floats = NDArray[np.float64]

#: Nodes and points along each axis, by the number of axes.
NODES = {1: 13, 2: 7, 3: 5}
POINTS = {1: 385, 2: 49, 3: 17}


@dataclass(frozen=True, eq=False)
class Surface:
    """One sheet of an effect: `nodes` (K, C, D) in the observables' units, `points` (M, p) where it is asked.

    `basis` (M, K) interpolates by cubic splines. `valid` (M,) is False beside nodes without an answer.
    """

    sheet: Sheet
    nodes: Floats
    points: Floats
    basis: Floats
    valid: NDArray[np.bool_]

    @classmethod
    def of(cls, sheet: Sheet, stages: Sequence[Stage]) -> Self:
        axes = len(sheet.axes)
        knots = _knots(NODES[axes])
        places = _grid([knots] * axes)
        sets = [[effect] for effect in sheet.effects(places)]
        table = np.concatenate([_asked(stage, sheet.kind, sets) for stage in stages], axis=2)
        points = _grid([np.linspace(0.0, 1.0, POINTS[axes])] * axes)
        good = np.isfinite(table).all(axis=(1, 2))
        near = _linear(places, points, NODES[axes]) @ (~good).astype(np.float64)
        return cls(sheet, _filled(table, places, good), points, basis(points, NODES[axes]), near < 1e-9)

    @property
    def id(self) -> str:
        return self.sheet.kind.id

    def only(self, rows: NDArray[np.intp]) -> Self:
        """On some of the configurations."""
        return replace(self, nodes=self.nodes[:, rows])

    def change(self, u: Floats) -> Floats:
        """(C, D) at one place u (p,)."""
        weights = basis(np.clip(u, 0.0, 1.0)[None], NODES[len(self.sheet.axes)])
        return np.asarray(np.tensordot(weights[0], self.nodes, axes=1))

    def effect(self, u: Floats) -> Effect:
        return self.sheet.effects(np.clip(u, 0.0, 1.0)[None])[0]


def surfaces(
    stages: Sequence[Stage], kinds: Iterable[type[Effect]], progress: Callable[[str], None] = lambda _: None
) -> tuple[Surface, ...]:
    """Every sheet of every effect that some stage can show."""
    shown = {identity for stage in stages for identity in stage.shows}
    found: list[Surface] = []
    for kind in kinds:
        if kind.id in shown:
            progress(kind.id)
            found += [Surface.of(sheet, stages) for sheet in sheets(kind)]
    return tuple(surface for surface in found if surface.valid.any())


def basis(points: Floats, knots: int) -> Floats:
    """(M, knots^p): weights of the nodes at points (M, p) by tensor products of cubic splines."""
    one = _splines(knots)
    factors = [np.asarray(one(points[:, i])) for i in range(points.shape[1])]
    return reduce(lambda a, b: (a[:, :, None] * b[:, None, :]).reshape(len(a), -1), factors)


def _asked(stage: Stage, kind: type[Effect], sets: Sequence[Sequence[Effect]]) -> Floats:
    if kind.id in stage.shows:
        return stage.changes(sets)
    return np.zeros((len(sets), len(stage.record.configurations), len(stage.observables)))


@cache
def _knots(n: int) -> Floats:
    """Denser at both ends, where splines are at their worst."""
    return np.asarray((1 - np.cos(np.pi * np.arange(n) / (n - 1))) / 2)


@cache
def _splines(n: int) -> Callable[[Floats], Floats]:
    from scipy.interpolate import CubicSpline

    return CubicSpline(_knots(n), np.eye(n))  # type: ignore[no-any-return]


def _grid(axes: Sequence[Floats]) -> Floats:
    return np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1)


def _linear(places: Floats, points: Floats, knots: int) -> Floats:
    """(M, K): which nodes stand around a point, as weights of the linear interpolation."""
    one = _knots(knots)
    hats = [np.stack([np.interp(points[:, i], one, row) for row in np.eye(knots)], 1) for i in range(points.shape[1])]
    return reduce(lambda a, b: (a[:, :, None] * b[:, None, :]).reshape(len(a), -1), hats)[:, : len(places)]


def _filled(table: Floats, places: Floats, good: NDArray[np.bool_]) -> Floats:
    """Nodes without an answer take that of the nearest one with: splines need some number there."""
    if good.all() or not good.any():
        return np.nan_to_num(table)
    distance = np.linalg.norm(places[:, None] - places[None, good], axis=2)
    nearest = np.flatnonzero(good)[distance.argmin(axis=1)]
    return np.asarray(table[np.where(good, np.arange(len(places)), nearest)])
