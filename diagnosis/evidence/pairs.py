"""Two effects at once: the sum of their changes on a coarse grid, refined, and then the pair itself simulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...twin.effects import Effect
from ..stages.base import Stage
from .logs import log_sum
from .scene import SMALLEST, Scene, Seen
from .singles import OnSurface
from .surface import basis

Floats = NDArray[np.float64]

#: Points of each effect on the coarse grid; along each axis of the fine one, by the effect's number of axes.
_POINTS = 72
_FINE = {1: 21, 2: 9, 3: 5}
#: Half the width of the fine grid, in standard deviations.
_REACH = 4.0
_STEPS, _TINY, _SLOPE = 8, 1e-4, 1e-3


@dataclass(frozen=True, eq=False)
class OnPair:
    """Two sheets at once: where they are likeliest (u of each, with standard deviations), and the evidence."""

    first: int  # of the scene's surfaces
    second: int
    u: tuple[Floats, Floats]
    width: tuple[Floats, Floats]
    background: int
    log_evidence: float

    def effects(self, scene: Scene) -> tuple[Effect, Effect]:
        return scene.surfaces[self.first].effect(self.u[0]), scene.surfaces[self.second].effect(self.u[1])


@dataclass(frozen=True, eq=False)
class _Points:
    """Places `u` (m, p) on one surface: `basis` (m, K), `change` (m, N) in tolerances, and the prior's mass (m,)."""

    u: Floats
    basis: Floats
    change: Floats
    log_mass: Floats


@dataclass(frozen=True, eq=False)
class Started:
    """A pair of sheets on the coarse grid, and refined from its best point, where `log_likelihood` is largest."""

    first: int
    second: int
    evidence: float
    best: _Best
    u: Floats
    width: Floats
    log_likelihood: float


def start_pair(
    scene: Scene, first: int, second: int, singles: Mapping[int, OnSurface], whitened: list[Floats]
) -> Started:
    """With the changes of both added up, each beyond tolerance alone."""
    coarse = (_thinned(scene, first, singles[first]), _thinned(scene, second, singles[second]))
    tables = _tables(scene, (first, second), coarse, whitened)
    best = _best(tables, coarse)
    u, width, largest = _refined(scene, (first, second), best, whitened[best.background])
    return Started(first, second, _total(tables, coarse), best, u, width, largest)


def of_pair(scene: Scene, started: Started, whitened: list[Floats]) -> OnPair:
    """Its evidence: where the posterior is narrower than the coarse grid, on a fine one around where it is largest."""
    pair, u, width = (started.first, started.second), started.u, started.width
    split = scene.surfaces[pair[0]].points.shape[1]
    widths = (width[:split], width[split:])
    if not np.all(width > _spacing(scene, pair)):
        fine = _around(scene, pair[0], u[:split], widths[0]), _around(scene, pair[1], u[split:], widths[1])
        tables = _tables(scene, pair, fine, whitened)
        total = _total(tables, fine)
        if np.isfinite(total):  # unless all around is within tolerance
            top = _best(tables, fine)
            return OnPair(*pair, top.u, widths, top.background, total)
    return OnPair(*pair, started.best.u, widths, started.best.background, started.evidence)


def interaction(scene: Scene, pair: OnPair, stages: Sequence[Stage]) -> Floats:
    """(N,): what two effects do together beyond the sum of what each does, where they are likeliest.

    NaN where together they have no answer, as where a shot stops.
    """
    effects = pair.effects(scene)
    tables = [stage.changes([list(effects), [effects[0]], [effects[1]]]) for stage in stages]
    together = np.concatenate(tables, axis=2)[:, scene.gap.rows]
    return scene.cells.take(together[0] - together[1] - together[2])


def _thinned(scene: Scene, index: int, single: OnSurface) -> _Points:
    """Points spread evenly through the allowed ones, and the one that is likeliest alone."""
    surface, prior = scene.surfaces[index], scene.log_prior[index]
    allowed = np.flatnonzero(np.isfinite(prior))
    spread = allowed[np.unique(np.linspace(0, len(allowed) - 1, _POINTS).astype(np.intp))]
    kept = np.unique(np.append(spread, single.best[0]))
    change = surface.basis[kept] @ scene.cells.take(surface.nodes)
    return _Points(surface.points[kept], surface.basis[kept], change, _normalised(prior[kept]))


def _around(scene: Scene, index: int, u: Floats, width: Floats) -> _Points:
    """A fine grid around u, clipped to the sheet; its mass is the prior's density there times the cells' size."""
    surface, prior = scene.surfaces[index], scene.log_prior[index]
    n = _FINE[len(u)]
    low, high = np.clip(u - _REACH * width, 0, 1), np.clip(u + _REACH * width, 0, 1)
    axes = [a + (b - a) * (np.arange(n) + 0.5) / n for a, b in zip(low, high, strict=True)]
    points = np.stack([grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")], axis=1)
    nearest = ((points[:, None, :] - surface.points[None]) ** 2).sum(axis=2).argmin(axis=1)
    cell = float(np.log(np.maximum(high - low, 1e-12)).sum()) - len(u) * float(np.log(n))
    here = basis(points, surface.knots)
    change = here @ scene.cells.take(surface.nodes)
    return _Points(points, here, change, prior[nearest] + np.log(len(prior)) + cell)


def _normalised(log_prior: Floats) -> Floats:
    return np.asarray(log_prior - log_sum(log_prior))


def _tables(
    scene: Scene, pair: tuple[int, int], points: tuple[_Points, _Points], whitened: list[Floats]
) -> list[Floats]:
    """Before each background (m, n): -1/2 |z - a - b|^2 and the constant."""
    one, two = points
    small = ~_beyond_tolerance(scene, points)
    tables = []
    for b, white in enumerate(scene.before):
        left, right, zw = scene.seen[pair[0]][b], scene.seen[pair[1]][b], whitened[b]
        alone = _alone(left, one, zw)[:, None] + _alone(right, two, zw)[None, :]
        cross = one.basis @ (left.nodes.T @ right.nodes) @ two.basis.T
        table = white.log_norm - 0.5 * float(zw @ zw) + alone - cross
        table[small] = -np.inf
        tables.append(table)
    return tables


def _beyond_tolerance(scene: Scene, points: tuple[_Points, _Points]) -> NDArray[np.bool_]:
    """(m, n): where what is left of both together is no gap within tolerance, as where they cancel each other."""
    one, two = points
    largest = np.zeros((len(one.u), len(two.u)))
    for stage in scene.gap.stages:
        a, b = (each.change[:, scene.kernels.stage == stage] for each in points)
        if a.shape[1]:
            square = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1)[None, :] + 2 * a @ b.T
            largest = np.maximum(largest, square / a.shape[1])
    return np.asarray(largest > SMALLEST**2)


def _alone(seen: Seen, points: _Points, zw: Floats) -> Floats:
    """(m,): z'a - 1/2 |a|^2"""
    square = np.einsum("mk,mk->m", points.basis @ seen.gram, points.basis)
    return np.asarray(points.basis @ (seen.nodes.T @ zw) - 0.5 * square)


@dataclass(frozen=True, eq=False)
class _Best:
    u: tuple[Floats, Floats]
    background: int


def _best(tables: list[Floats], points: tuple[_Points, _Points]) -> _Best:
    mass = points[0].log_mass[:, None] + points[1].log_mass[None, :]
    background = int(np.argmax([float((mass + table).max()) for table in tables]))
    i, j = np.unravel_index(int(np.argmax(mass + tables[background])), mass.shape)
    return _Best((points[0].u[i], points[1].u[j]), background)


def _total(tables: list[Floats], points: tuple[_Points, _Points]) -> float:
    mass = points[0].log_mass[:, None] + points[1].log_mass[None, :]
    return float(log_sum(np.stack([mass + table for table in tables])) - np.log(len(tables)))


def _refined(scene: Scene, pair: tuple[int, int], best: _Best, zw: Floats) -> tuple[Floats, Floats, float]:
    """Gauss-Newton with bounds from the grid's best point: place, standard deviations (p,), log likelihood there."""
    u = np.clip(np.concatenate(best.u), _TINY, 1 - _TINY)
    left, jacobian = _model(scene, pair, u, best.background, zw)
    for _ in range(_STEPS):
        free = ~((u <= 0) & (jacobian.T @ left < 0) | (u >= 1) & (jacobian.T @ left > 0))
        step = np.zeros(len(u))
        normal = jacobian[:, free].T @ jacobian[:, free] + _TINY * np.eye(int(free.sum()))
        step[free] = np.linalg.solve(normal, jacobian[:, free].T @ left)
        tried, after, steeper = _shortened(scene, pair, u, step, best.background, zw)
        if after @ after >= left @ left - 1e-3:
            break
        u, left, jacobian = tried, after, steeper
    width = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian + np.eye(len(u)))))
    return u, width, scene.before[best.background].log_norm - 0.5 * float(left @ left)


def _shortened(
    scene: Scene, pair: tuple[int, int], u: Floats, step: Floats, background: int, zw: Floats
) -> tuple[Floats, Floats, Floats]:
    """The best of a step, a third and a tenth of it."""
    tried = [np.clip(u + share * step, 0.0, 1.0) for share in (1.0, 0.3, 0.1)]
    models = [(place, *_model(scene, pair, place, background, zw)) for place in tried]
    return min(models, key=lambda each: float(each[1] @ each[1]))


def _model(scene: Scene, pair: tuple[int, int], u: Floats, background: int, zw: Floats) -> tuple[Floats, Floats]:
    """What the changes at u leave of z, whitened (N,), and the slopes of the changes (N, p)."""
    split = scene.surfaces[pair[0]].points.shape[1]
    left, slopes = zw, []
    for index, place in zip(pair, (u[:split], u[split:]), strict=True):
        nodes, p = scene.seen[index][background].nodes, len(place)
        inside = np.clip(place, _SLOPE, 1 - _SLOPE)
        rows = np.vstack([place, inside + _SLOPE * np.eye(p), inside - _SLOPE * np.eye(p)])
        values = nodes @ basis(rows, round(nodes.shape[1] ** (1 / p))).T
        left = left - values[:, 0]
        slopes.append((values[:, 1 : p + 1] - values[:, p + 1 :]) / (2 * _SLOPE))
    return np.asarray(left), np.concatenate(slopes, axis=1)


def _spacing(scene: Scene, pair: tuple[int, int]) -> Floats:
    """(p,): of the coarse grid."""
    axes = [scene.surfaces[i].points.shape[1] for i in pair]
    return np.concatenate([np.full(p, _POINTS ** (-1.0 / p)) for p in axes])
