"""Shrinkage, honestly: everything is chosen inside the fold, and the noise floor cannot be removed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...twin.effects import Effect
from ..localisation.means import Floats
from ..stages.base import Stage
from ..verdict import Shrinkage
from .folds import Split, by_configuration, corner
from .gaps import Gaps
from .interval import Unsure, fraction, fraction_interval
from .more import further

Rows = NDArray[np.intp]
#: Training configurations (rows of the record) to the cause that they speak for, with its parameters; () for none.
Choose = Callable[[Rows], Sequence[Effect]]


def shrinkage(
    stages: Sequence[Stage],
    choose: Choose,
    rng: np.random.Generator,
    scales: Mapping[str, Floats] | None = None,
    pulses: bool = True,
) -> tuple[Shrinkage, ...]:
    """Held out by configuration in five folds, and once a corner of the factor space, where there is one.

    `before` and `after` are rms over held-out configurations and observables of mean residuals over `scales` (d,) by
    stage (tolerances where none is given; infinite: left out), repetition scatter included. `fraction` is what
    disappears of what is above the scatter's part. It is None where the gap before is not two standard errors of the
    scatter above it: no gap to shrink. Negative: the cause made it worse. `effects` are those that most folds chose.
    `pulses`: whether force pulses are rated after ISO 18571, which costs their simulation.
    """
    gaps = Gaps.of(stages, scales)
    if len(gaps.rows) < 2:
        return ()
    at_corner = corner(stages[0].record.configurations, gaps.rows, np.sqrt(gaps.squares()))
    splits = [by_configuration(gaps.rows, rng), *([] if at_corner is None else [at_corner])]
    held = [_HeldOut.of(stages, gaps, split, choose) for split in splits]
    return tuple(_entry(stages, gaps, each, _training_spread(gaps, each, held[0]), rng, pulses) for each in held)


@dataclass(frozen=True, eq=False)
class _HeldOut:
    """What each fold chose, and what its choice adds to the simulation, (k, C, D) over the scale."""

    split: Split
    chosen: tuple[tuple[Effect, ...], ...]
    corrections: Floats

    @classmethod
    def of(cls, stages: Sequence[Stage], gaps: Gaps, split: Split, choose: Choose) -> Self:
        chosen = tuple(tuple(choose(np.setdiff1d(gaps.rows, held))) for held in split.folds)
        return cls(split, chosen, gaps.corrections(stages, chosen))

    @property
    def correction(self) -> Floats:
        """(C, D): each configuration's by the fold that has not seen it."""
        whole = np.zeros_like(self.corrections[0])
        for held, table in zip(self.split.folds, self.corrections, strict=True):
            whole[held] = table[held]
        return np.asarray(whole)

    @property
    def effects(self) -> tuple[str, ...]:
        """What most folds chose."""
        return Counter(_ids(each) for each in self.chosen).most_common(1)[0][0]


def _entry(
    stages: Sequence[Stage], gaps: Gaps, held: _HeldOut, training: float, rng: np.random.Generator, pulses: bool
) -> Shrinkage:
    rows, correction = held.split.held_out, held.correction
    before, after, floor = (each[rows] for each in (gaps.squares(), gaps.squares(correction), gaps.floor))
    chance = float(np.sqrt((gaps.chance[rows] ** 2).sum()) / len(rows))
    is_gap = before.mean() - floor.mean() > 2 * chance
    unsure = Unsure(gaps.floor_unsure, training)
    return Shrinkage(
        effects=held.effects,
        held_out_by=held.split.name,
        before=float(np.sqrt(before.mean())),
        after=float(np.sqrt(after.mean())),
        fraction=_share(before, after, floor) if is_gap else None,
        ci90=fraction_interval(before, after, floor, rng, unsure) if is_gap else None,
        more=further(stages, gaps, held.split, held.chosen, correction, pulses),
    )


def _share(before: Floats, after: Floats, floor: Floats) -> float:
    return float(fraction(*(np.array(each.mean()) for each in (before, after, floor))))


def _training_spread(gaps: Gaps, held: _HeldOut, folds: _HeldOut) -> float:
    """Standard deviation of the fraction by the choice of training configurations: a jackknife over the folds.

    Over folds that chose the same effects; a fold that chose another one has its say in the fraction itself.
    """
    rows = held.split.held_out
    alike = [t for each, t in zip(folds.chosen, folds.corrections, strict=True) if _ids(each) == held.effects]
    shares = [_share(gaps.squares()[rows], gaps.squares(table)[rows], gaps.floor[rows]) for table in alike]
    if len(shares) < 2 or not np.isfinite(shares).all():
        return 0.0
    return float(np.sqrt((len(shares) - 1) * np.var(shares)))


def _ids(effects: Sequence[Effect]) -> tuple[str, ...]:
    return tuple(effect.id for effect in effects)
