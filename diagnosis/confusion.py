"""Effects that the data at hand cannot tell apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .evidence.form import SHARES, form_modes
from .evidence.weighing import Weighed
from .verdict import NONE, UNKNOWN

Floats = NDArray[np.float64]

#: Two hypotheses are one where the data would choose the wrong one in a tenth of the cases: Phi(-D / 2) > 0.10,
NEAR = 2.6
#: and where these data leave it a tenth.
WRONG = 0.10
#: A group names at most so many; and none that is so much less likely than its first.
MOST, LEAST_SHARE = 4, 0.02


@dataclass(frozen=True)
class Group:
    """Hypotheses under one probability, the likeliest first, each with its own."""

    members: tuple[str, ...]
    each: tuple[float, ...]

    @property
    def probability(self) -> float:
        return sum(self.each)


def groups(weighed: Weighed, probability: dict[str, float]) -> tuple[Group, ...]:
    """Every hypothesis in one group, the likeliest group first. `none` and `unknown` stand alone."""
    left = sorted(probability, key=lambda name: -probability[name])
    modes = form_modes(weighed.scene)
    found: list[Group] = []
    while left:
        first = left.pop(0)
        members = [first, *_near(weighed, first, left, probability, modes)]
        left = [name for name in left if name not in members]
        found.append(Group(tuple(members), tuple(probability[name] for name in members)))
    return tuple(sorted(found, key=lambda group: -group.probability))


def _near(weighed: Weighed, first: str, others: list[str], probability: dict[str, float], modes: Floats) -> list[str]:
    if first in (NONE, UNKNOWN):
        return []
    place, found = None, []
    for name in others:
        alike = name not in (NONE, UNKNOWN) and ("+" in name) == ("+" in first)
        if not alike or probability[name] <= LEAST_SHARE * probability[first]:
            continue
        if probability[name] < WRONG * (probability[first] + probability[name]):
            place = place or _Place.of(weighed, first, modes)
            if place.distance(weighed, name) >= NEAR:
                continue
        found.append(name)
    return found[: MOST - 1]


def distance(weighed: Weighed, one: str, other: str) -> float:
    """D: by how many standard deviations the other differs from the one, as fitted, at its nearest.

    Before the background that is likeliest under the one, whose law may be off by the share that its evidence allows.
    The nearest of a single effect over all its likely parameters, of a pair as it was fitted to the same data.
    """
    return _Place.of(weighed, one, form_modes(weighed.scene)).distance(weighed, other)


@dataclass(frozen=True, eq=False)
class _Place:
    """Where a hypothesis was fitted: its change (N,), whitened, before background `index`; what an error of its law's
    form takes off products is `off` (N, q): x . y - (off' x) . (off' y)."""

    index: int
    change: Floats
    off: Floats

    @classmethod
    def of(cls, weighed: Weighed, name: str, modes: Floats) -> _Place:
        from scipy.linalg import cholesky, solve_triangular

        index, fitted = _background(weighed, name), _fitted(weighed, name)
        white = weighed.scene.before[index]
        u = white.white(SHARES[-1] * fitted[:, None] * modes)
        lower = cholesky(np.eye(u.shape[1]) + u.T @ u, lower=True)
        return cls(index, white.white(fitted), solve_triangular(lower, u.T, lower=True).T)

    def distance(self, weighed: Weighed, other: str) -> float:
        scene = weighed.scene
        if "+" in other:
            apart = self.change - scene.before[self.index].white(_fitted(weighed, other))
            return float(np.sqrt(self._product(apart, apart)))
        return min((self._to_sheet(weighed, index) for index in scene.sheets(other)), default=np.inf)

    def _to_sheet(self, weighed: Weighed, index: int) -> float:
        scene = weighed.scene
        seen, basis = scene.seen[index][self.index], scene.surfaces[index].basis
        across = self.off.T @ seen.nodes
        own = self._product(self.change, self.change)
        both = seen.nodes.T @ self.change - across.T @ (self.off.T @ self.change)
        square = own - 2 * basis @ both + seen.square - ((basis @ across.T) ** 2).sum(axis=1)
        allowed = square[np.isfinite(scene.log_prior[index])]
        return float(np.sqrt(max(0.0, allowed.min(initial=np.inf))))

    def _product(self, x: Floats, y: Floats) -> float:
        return float(x @ y - (self.off.T @ x) @ (self.off.T @ y))


def _background(weighed: Weighed, name: str) -> int:
    if name in weighed.pairs:
        return weighed.pairs[name].background
    return weighed.best_sheet(name).best[1] % len(weighed.scene.before)


def _fitted(weighed: Weighed, name: str) -> Floats:
    """(N,): the change of a hypothesis as it was fitted, in tolerances."""
    scene = weighed.scene
    if name in weighed.pairs:
        pair = weighed.pairs[name]
        tables = [scene.surfaces[i].change(u) for i, u in zip((pair.first, pair.second), pair.u, strict=True)]
        return scene.cells.take(tables[0] + tables[1])
    sheet = weighed.best_sheet(name)
    return scene.cells.take(sheet.surface.change(weighed.best_point(name)))
