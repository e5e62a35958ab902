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
NODES = {1: 13, 2: 9, 3: 5}
POINTS = {1: 385, 2: 49, 3: 17}
#: Places along an axis at which its end is looked for; a change of so many tolerances is no small unmodelled effect.
_PROBES, _ABSURD = 17, 100.0


@dataclass(frozen=True, eq=False)
class Surface:
    """One sheet of an effect: `nodes` (K, C, D) in the observables' units, `points` (M, p) where it is asked.

    `basis` (M, K) interpolates by local cubics. `valid` (M,) is False beside nodes without an answer.
    `loose` (K, C, D) are standard deviations of what a law leaves open, by one factor for all configurations.
    """

    sheet: Sheet
    nodes: Floats
    points: Floats
    basis: Floats
    valid: NDArray[np.bool_]
    loose: Floats | None = None

    @classmethod
    def of(cls, sheet: Sheet, stages: Sequence[Stage]) -> Self:
        sheet = _trimmed(sheet, stages)
        axes = len(sheet.axes)
        knots = _knots(NODES[axes])
        places = _grid([knots] * axes)
        sets = [[effect] for effect in sheet.effects(places)]
        table = _all_asked(stages, sheet.kind, sets)
        points = _grid([np.linspace(0.0, 1.0, POINTS[axes])] * axes)
        good = np.asarray(np.isfinite(table).all(axis=(1, 2)), dtype=np.bool_)
        beside = _linear(points, NODES[axes])
        near = beside @ _widened(~good, axes).astype(np.float64)
        open_ = _loose(stages, sets, table)
        return cls(sheet, _filled(table, places, good), points, basis(points, NODES[axes]), near < 1e-9, open_)

    @property
    def id(self) -> str:
        return self.sheet.kind.id

    @property
    def knots(self) -> int:
        """Nodes along each axis."""
        knots: int = round(len(self.nodes) ** (1 / self.points.shape[1]))
        return knots

    def only(self, rows: NDArray[np.intp]) -> Self:
        """On some of the configurations."""
        return replace(self, nodes=self.nodes[:, rows], loose=None if self.loose is None else self.loose[:, rows])

    def change(self, u: Floats) -> Floats:
        """(C, D) at one place u (p,)."""
        weights = basis(np.clip(u, 0.0, 1.0)[None], self.knots)
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
    """(M, knots^p): weights of the nodes at points (M, p) by tensor products of cubics."""
    one = _splines(knots)
    factors = [np.asarray(one(points[:, i])) for i in range(points.shape[1])]
    return reduce(lambda a, b: (a[:, :, None] * b[:, None, :]).reshape(len(a), -1), factors)


def _trimmed(sheet: Sheet, stages: Sequence[Stage]) -> Sheet:
    """Each axis up to where, alone, it still has an answer everywhere: nodes beyond would be wasted."""
    n = len(sheet.axes)
    if _answers(sheet, stages, np.ones((1, n)))[0]:
        return sheet
    axes = []
    for i, axis in enumerate(sheet.axes):
        places = np.zeros((_PROBES, n))
        places[:, i] = np.linspace(0, 1, _PROBES)
        good = _answers(sheet, stages, places)
        last = int(np.argmin(good)) - 1 if not good.all() else _PROBES - 1
        axes.append(axis if last < 1 else axis.up_to(float(places[last, i])))
    return replace(sheet, axes=tuple(axes))


def _answers(sheet: Sheet, stages: Sequence[Stage], places: Floats) -> NDArray[np.bool_]:
    """(k,): where all is finite and no change is absurd."""
    table = _all_asked(stages, sheet.kind, [[effect] for effect in sheet.effects(places)])
    tolerance = np.array([item.tolerance for stage in stages for item in stage.observables])
    with np.errstate(invalid="ignore"):
        return np.asarray((np.abs(table) < _ABSURD * tolerance).all(axis=(1, 2)))


def _loose(stages: Sequence[Stage], sets: Sequence[Sequence[Effect]], table: Floats) -> Floats | None:
    """(K, C, D) of changes (K, C, D), None where every law is definite; 0 where there is no answer."""
    ends = np.cumsum([0, *(len(stage.observables) for stage in stages)])
    out, any_ = np.zeros_like(table), False
    for stage, first, last in zip(stages, ends[:-1], ends[1:], strict=True):
        for k, effects in enumerate(sets):
            found = stage.loose(effects, table[k, :, first:last])
            if found is not None:
                out[k, :, first:last], any_ = np.nan_to_num(found), True
    return out if any_ else None


def _all_asked(stages: Sequence[Stage], kind: type[Effect], sets: Sequence[Sequence[Effect]]) -> Floats:
    """(k, C, D)"""
    return np.concatenate([_asked(stage, kind, sets) for stage in stages], axis=2)


def _asked(stage: Stage, kind: type[Effect], sets: Sequence[Sequence[Effect]]) -> Floats:
    if kind.id not in stage.shows:
        return np.zeros((len(sets), len(stage.record.configurations), len(stage.observables)))
    if stage.fingerprint is None:
        return stage.changes(sets)
    key = (type(stage), stage.fingerprint, tuple(effect for each in sets for effect in each))
    if key not in _KEPT:
        if len(_KEPT) >= _MOST_KEPT:
            _KEPT.pop(next(iter(_KEPT)))
        _KEPT[key] = stage.changes(sets)
    return _KEPT[key]


#: Tables of campaigns of one design, the oldest first: a valve takes seconds.
_KEPT: dict[object, Floats] = {}
_MOST_KEPT = 400


@cache
def _knots(n: int) -> Floats:
    """Denser at both ends, where interpolation is at its worst."""
    return np.asarray((1 - np.cos(np.pi * np.arange(n) / (n - 1))) / 2)


@cache
def _splines(n: int) -> Callable[[Floats], Floats]:
    """Cubics with slopes of three nodes: local, so that a node without an answer spoils the cells around it only."""
    from scipy.interpolate import CubicHermiteSpline

    values = np.eye(n)
    return CubicHermiteSpline(_knots(n), values, np.gradient(values, _knots(n), axis=0, edge_order=2))


def _grid(axes: Sequence[Floats]) -> Floats:
    return np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1)


def _linear(points: Floats, knots: int) -> Floats:
    """(M, K): which nodes stand around a point, as weights of the linear interpolation."""
    one = _knots(knots)
    hats = [np.stack([np.interp(points[:, i], one, row) for row in np.eye(knots)], 1) for i in range(points.shape[1])]
    return reduce(lambda a, b: (a[:, :, None] * b[:, None, :]).reshape(len(a), -1), hats)


def _widened(bad: NDArray[np.bool_], axes: int) -> NDArray[np.bool_]:
    """With the nodes next to those without an answer: slopes there hang on numbers that are made up."""
    from scipy.ndimage import binary_dilation

    knots = NODES[axes]
    grid = binary_dilation(bad.reshape([knots] * axes), np.ones([3] * axes, dtype=bool))
    return np.asarray(grid.ravel(), dtype=np.bool_)


def _filled(table: Floats, places: Floats, good: NDArray[np.bool_]) -> Floats:
    """Nodes without an answer take that of the nearest one with: some number must stand there."""
    if good.all() or not good.any():
        return np.nan_to_num(table)
    distance = np.linalg.norm(places[:, None] - places[None, good], axis=2)
    nearest = np.flatnonzero(good)[distance.argmin(axis=1)]
    return np.asarray(table[np.where(good, np.arange(len(places)), nearest)])
