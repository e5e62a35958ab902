"""Shrinkage, honestly: everything is chosen inside the fold, and the noise floor cannot be removed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...twin.effects import Effect
from ..inference.held_out import FoldFit
from ..localisation.means import Floats
from ..observables.base import Stage
from ..verdict import Shrinkage
from .folds import Split, by_configuration, corner
from .gaps import Gaps
from .interval import Unsure, fraction, fraction_interval
from .stage_metrics import further

Rows = NDArray[np.intp]
#: The entry of `Shrinkage.more` with what goes when the learned discrepancy corrects the rest.
CORRECTED = "with the learned discrepancy"


def shrinkage(
    stages: Sequence[Stage],
    fit: Callable[[Rows], FoldFit],
    rng: np.random.Generator,
    scales: Mapping[str, Floats] | None = None,
    pulses: bool = True,
) -> tuple[Shrinkage, ...]:
    """Held out by configuration in five folds, and once a corner of the factor space, where there is one.

    `fit` chooses and fits effects on training configurations (rows of the record). `before` and `after` are rms over
    held-out configurations and observables of mean residuals over `scales` (d,) by stage (tolerances where none is
    given; infinite: left out), repetition scatter included. `fraction` is what disappears of what is above the
    scatter's part. It is None where the gap before is not two standard errors of the scatter above it: no gap to
    shrink. Negative: the effects made it worse. `effects` are those that most folds chose. `pulses`: whether force
    pulses are rated after ISO 18571, which costs their simulation.
    """
    return tuple(entry for entry, _ in measured(stages, fit, rng, scales, pulses))


def measured(
    stages: Sequence[Stage],
    fit: Callable[[Rows], FoldFit],
    rng: np.random.Generator,
    scales: Mapping[str, Floats] | None = None,
    pulses: bool = True,
) -> list[tuple[Shrinkage, HeldOut]]:
    """The same with what each fold fitted."""
    gaps = Gaps.of(stages, scales)
    if len(gaps.rows) < 2:
        return []
    at_corner = corner(stages[0].record.configurations, gaps.rows, np.sqrt(gaps.squares()))
    splits = [by_configuration(gaps.rows, rng), *([] if at_corner is None else [at_corner])]
    held = [HeldOut.of(gaps, split, fit) for split in splits]
    return [(_entry(stages, gaps, own, _training_spread(gaps, own, held[0]), rng, pulses), own) for own in held]


@dataclass(frozen=True, eq=False)
class HeldOut:
    """What each fold of a split fitted; `corrections` (k, C, D): what its effects add to the simulation, over the scale
    of `gaps`."""

    gaps: Gaps
    split: Split
    folds: tuple[FoldFit, ...]
    corrections: Floats

    @classmethod
    def of(cls, gaps: Gaps, split: Split, fit: Callable[[Rows], FoldFit]) -> Self:
        folds = tuple(fit(np.setdiff1d(gaps.rows, held)) for held in split.folds)
        return cls(gaps, split, folds, gaps.over_scale(np.array([fold.averaged for fold in folds])))

    @property
    def chosen(self) -> tuple[tuple[Effect, ...], ...]:
        """The likeliest effects of each fold, as it fitted them."""
        return tuple(fold.likeliest for fold in self.folds)

    def unseen(self, tables: Floats) -> Floats:
        """(C, D): of tables (k, C, D), each configuration's by the fold that has not seen it; else 0."""
        whole = np.zeros_like(tables[0])
        for held, table in zip(self.split.folds, tables, strict=True):
            whole[held] = table[held]
        return np.asarray(whole)

    @property
    def correction(self) -> Floats:
        return self.unseen(self.corrections)

    @property
    def corrected(self) -> Floats:
        """The same with the learned discrepancy."""
        return self.unseen(self.gaps.over_scale(np.array([fold.corrected for fold in self.folds])))

    @property
    def effects(self) -> tuple[str, ...]:
        """What most folds chose."""
        return Counter(_ids(effects) for effects in self.chosen).most_common(1)[0][0]

    def squares(self, correction: Floats | float = 0.0) -> Floats:
        """(n,): mean squared gap of each held-out configuration."""
        return self.gaps.squares(correction)[self.split.held_out]

    @property
    def is_gap(self) -> bool:
        """Whether the gap is two standard errors of the scatter above the scatter's part: else none to shrink."""
        rows = self.split.held_out
        chance = float(np.sqrt((self.gaps.chance[rows] ** 2).sum()) / len(rows))
        return bool(self.squares().mean() - self.gaps.floor[rows].mean() > 2 * chance)

    def fraction(self, correction: Floats) -> float:
        """Of the reducible gap, that a correction (C, D) takes away where it is held out."""
        rows = self.split.held_out
        return _share(self.squares(), self.squares(correction), self.gaps.floor[rows])


def _entry(
    stages: Sequence[Stage], gaps: Gaps, held: HeldOut, training: float, rng: np.random.Generator, pulses: bool
) -> Shrinkage:
    rows, correction = held.split.held_out, held.correction
    before, after, floor = (each[rows] for each in (gaps.squares(), gaps.squares(correction), gaps.floor))
    unsure = Unsure(gaps.floor_unsure, training)
    return Shrinkage(
        effects=held.effects,
        held_out_by=held.split.name,
        before=float(np.sqrt(before.mean())),
        after=float(np.sqrt(after.mean())),
        fraction=_share(before, after, floor) if held.is_gap else None,
        ci90=fraction_interval(before, after, floor, rng, unsure) if held.is_gap else None,
        more={
            CORRECTED: (float(np.sqrt(before.mean())), float(np.sqrt(held.squares(held.corrected).mean()))),
            **further(stages, gaps, held.split, held.chosen, correction, pulses),
        },
    )


def _share(before: Floats, after: Floats, floor: Floats) -> float:
    return float(fraction(*(np.array(each.mean()) for each in (before, after, floor))))


def _training_spread(gaps: Gaps, held: HeldOut, folds: HeldOut) -> float:
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
