"""Effects that the data at hand cannot tell apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .evidence.weighing import Weighed
from .verdict import NONE, UNKNOWN

Floats = NDArray[np.float64]

#: Two hypotheses are one where the data would choose the wrong one in a tenth of the cases: Phi(-D / 2) > 0.10.
NEAR = 2.6
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
    found: list[Group] = []
    while left:
        first = left.pop(0)
        members = [first, *_near(weighed, first, left, probability)]
        left = [name for name in left if name not in members]
        found.append(Group(tuple(members), tuple(probability[name] for name in members)))
    return tuple(sorted(found, key=lambda group: -group.probability))


def _near(weighed: Weighed, first: str, others: list[str], probability: dict[str, float]) -> list[str]:
    if first in (NONE, UNKNOWN):
        return []
    found = []
    for name in others:
        alike = name not in (NONE, UNKNOWN) and ("+" in name) == ("+" in first)
        if alike and probability[name] > LEAST_SHARE * probability[first] and distance(weighed, first, name) < NEAR:
            found.append(name)
    return found[: MOST - 1]


def distance(weighed: Weighed, one: str, other: str) -> float:
    """D: by how many standard deviations the other differs from the one, as fitted, at its nearest.

    Before the background that is likeliest under the one. The nearest of a single effect over all its likely
    parameters, of a pair as it was fitted to the same data.
    """
    scene = weighed.scene
    background = _background(weighed, one)
    change = scene.before[background].white(_fitted(weighed, one))
    if "+" in other:
        return float(np.linalg.norm(change - scene.before[background].white(_fitted(weighed, other))))
    nearest = np.inf
    for index in scene.sheets(other):
        seen, surface = scene.seen[index][background], scene.surfaces[index]
        square = change @ change - 2 * surface.basis @ (seen.nodes.T @ change) + seen.square
        allowed = square[np.isfinite(scene.log_prior[index])]
        nearest = min(nearest, float(np.sqrt(max(0.0, allowed.min(initial=np.inf)))))
    return nearest


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
