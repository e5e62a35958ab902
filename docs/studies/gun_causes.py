"""What single effects and pairs need to be to explain a gun's velocities: least squares, without
priors.

Glossary: y measured less nominal ln velocity, a mean for each configuration; s its standard error;
u in [0, 1] the place of a parameter in its allowed range.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.twin.effects import Effect, Parameter, catalogue

Floats = NDArray[np.float64]
_GRID = {1: 41, 2: 9, 3: 5, 4: 4, 5: 3, 6: 2}
_STEPS, _DAMPINGS = 15, 10.0 ** np.arange(-4.0, 5.0)
#: Parameters reach down to this share of their range, on a power scale.
_POWER = 4


@dataclass(frozen=True, eq=False)
class Gap:
    """Of a stage: means y (C,), their standard errors s (C,), shots in each (C,)."""

    y: Floats
    s: Floats
    shots: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Fit:
    """Effects at their best. `change` (C,) is theirs in all configurations, `chi2` that of the
    fitted ones."""

    effects: tuple[Effect, ...]
    change: Floats
    chi2: float
    likely: bool  # every parameter lies where benches have it

    @property
    def name(self) -> str:
        return "+".join(each.id for each in self.effects)


def gap(stage: GunObservables, scatter: float | None = None) -> Gap:
    """Standard errors from the repetitions of each configuration, or from one relative `scatter`
    for all shots.

    A configuration of one shot takes the stated uncertainty.
    """
    of, residual = stage.record.configuration_of, stage.residuals()[:, 0]
    groups = [residual[of == c] for c in range(len(stage.record.configurations))]
    floor = stage.observables[0].floor
    spread = [scatter or (group.std(ddof=1) if group.size > 1 else floor) for group in groups]
    shots = np.array([group.size for group in groups])
    return Gap(
        np.array([group.mean() for group in groups]), np.array(spread) / np.sqrt(shots), shots
    )


def fit(
    stage: GunObservables,
    of: Gap,
    ids: Sequence[str],
    rows: Sequence[int] | None = None,
    *,
    anywhere: bool = False,
) -> Fit:
    """Effects of these ids fitted to configurations `rows` (all), in their best regime.

    Parameters stay where benches have them, or `anywhere` in their allowed ranges.
    """
    some = np.arange(of.y.size) if rows is None else np.asarray(rows)
    regimes = product(*[_regimes(catalogue()[identity]) for identity in ids])
    return min(
        (_fit(stage, of, _Space(regime, anywhere), some) for regime in regimes),
        key=lambda each: each.chi2,
    )


Regime = tuple[type[Effect], tuple[Parameter, ...]]


@dataclass(frozen=True)
class _Space:
    """Effects and those of their parameters that are fitted; the others that a diagnosis looks for
    are off."""

    regimes: tuple[Regime, ...]
    anywhere: bool

    @property
    def size(self) -> int:
        return sum(len(items) for _, items in self.regimes)

    def effects(self, u: Floats) -> list[Effect]:
        """At places u (size,)."""
        at = iter(u)
        made = []
        for kind, items in self.regimes:
            off = {item.name: item.off for item in kind.parameters() if item.likely is not None}
            made.append(
                kind(
                    **off
                    | {item.name: _value(item, float(next(at)), self.anywhere) for item in items}
                )
            )
        return made

    def likely(self, effects: Sequence[Effect]) -> bool:
        pairs = [
            (each, item)
            for each, (_, items) in zip(effects, self.regimes, strict=True)
            for item in items
        ]
        return all(
            i.likely is None or i.likely[0] <= getattr(each, i.name) <= i.likely[1]
            for each, i in pairs
        )


def _regimes(kind: type[Effect]) -> list[Regime]:
    searched = {item.name: item for item in kind.parameters() if item.likely is not None}
    return [
        (kind, tuple(searched[name] for name in names))
        for names in kind.regimes or (tuple(searched),)
    ]


def _fit(stage: GunObservables, of: Gap, space: _Space, some: NDArray[np.intp]) -> Fit:
    """A grid, then the steps of Levenberg and Marquardt, each one batch of shots."""

    def misfits(points: Floats) -> Floats:
        """(points, rows): whitened; 1e3 where a shot stays in the barrel."""
        changes = stage.changes([space.effects(u) for u in points])[:, some, 0]
        return np.nan_to_num((of.y[some] - changes) / of.s[some], nan=1e3)

    axis = np.linspace(0, 1, _GRID[space.size])
    best = _descended(misfits, np.array(list(product(axis, repeat=space.size))))
    effects = space.effects(best)
    chi2 = float(np.sum(misfits(best[None])[0] ** 2))
    return Fit(tuple(effects), stage.changes([effects])[0, :, 0], chi2, space.likely(effects))


def left_out(stage: GunObservables, of: Gap, ids: Sequence[str]) -> Floats:
    """(C,): ln measured over predicted of each configuration by effects that were fitted to the
    others."""
    every = range(of.y.size)
    return np.array(
        [of.y[c] - fit(stage, of, ids, [i for i in every if i != c]).change[c] for c in every]
    )


def left_out_factor(of: Gap) -> Floats:
    """The same by a constant factor, as eq. 2.18's."""
    weight = of.s**-2
    return np.array(
        [
            of.y[c] - np.average(np.delete(of.y, c), weights=np.delete(weight, c))
            for c in range(of.y.size)
        ]
    )


def distances(fits: Sequence[Fit], s: Floats) -> Floats:
    """(k, k): how far fitted effects lie from one another, in standard errors."""
    changes = np.array([each.change for each in fits]) / s
    return np.asarray(np.sqrt(((changes[:, None] - changes[None]) ** 2).sum(axis=2)))


def _value(item: Parameter, u: float, anywhere: bool) -> float:
    """Parameters that may change sign or are ratios around one go evenly, the others by a power
    from their least."""
    low, high = (item.low, item.high) if anywhere or item.likely is None else item.likely
    return low + (high - low) * (u if low < item.off < high else u**_POWER)


def _descended(misfits: Callable[[Floats], Floats], points: Floats) -> Floats:
    cost = (misfits(points) ** 2).sum(axis=1)
    best: Floats = points[np.argmin(cost)]
    least, size, h = float(cost.min()), best.size, 1e-4
    for _ in range(_STEPS):
        inward = np.where(best > 0.5, -h, h)
        found = misfits(np.vstack([best, best + np.diag(inward)]))
        slopes = ((found[1:] - found[0]) / inward[:, None]).T
        square, pull = slopes.T @ slopes, slopes.T @ found[0]
        scale = np.diag(np.diag(square) + 1e-12)
        steps = np.array(
            [np.linalg.solve(square + d * scale + 1e-12 * np.eye(size), pull) for d in _DAMPINGS]
        )
        trials = np.clip(best - steps, 0, 1)
        cost = (misfits(trials) ** 2).sum(axis=1)
        if not cost.min() < least * (1 - 1e-6):
            break
        best, least = trials[np.argmin(cost)], float(cost.min())
    return best
