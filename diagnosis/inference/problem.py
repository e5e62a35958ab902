"""A campaign's gap as an inference problem: cells in tolerances, their covariances, the simulator of all effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats, Rows
from ...twin.effects import Effect, catalogue
from ..gap import GapTable
from ..observables.base import Stage
from .effect_laws import EffectLaw, LawRanges, Owners, laws_of, owners_of
from .joint_simulation import JointSimulator, Point, negligible_places
from .model_error import ErrorKernels, bank

#: A cell in which a set of effects has no answer (a shot that stays in the barrel) is off by so many tolerances.
NO_ANSWER = 30.0
#: Variance, in tolerances squared: no simulator is better than a seventh of its tolerance anywhere.
_LEAST = 0.02
#: Values at which a parameter is tried for where it begins to be seen, as shares of its likely end.
_PROBES = np.geomspace(1e-5, 1.0, 16)


@dataclass(frozen=True, eq=False)
class StageBlock:
    """The N cells of one stage. `z` (N,) is the gap in tolerances; `covariances` (B, N, N) what repetitions, uncertain
    nominal parameters and each background of the bank leave in it; `discrepancy` (N, N) how a law's errors go together;
    `detail` (N,) which cells are a detail of shape or timing.
    """

    stage: str
    configuration: Rows
    observable: Rows
    tolerance: Floats
    z: Floats
    covariances: Floats
    discrepancy: Floats
    detail: NDArray[np.bool_]

    @classmethod
    def of(cls, gap: GapTable, stage: str) -> Self:
        columns = np.zeros(len(gap.observables), dtype=bool)
        columns[gap.columns(stage)] = True
        c, o = np.nonzero((gap.count > 0) & columns[None, :])
        tolerance = gap.tolerance[o]
        factors = [configuration.factors for configuration in gap.record.configurations]
        kernels = ErrorKernels.of(factors, gap.observables, c, o)
        noise = _noise(gap, c, o) / np.outer(tolerance, tolerance) + _LEAST * np.eye(len(c))
        covariances = np.stack([noise + kernels.background(member) for member in bank(stage)])
        return cls(
            stage, c, o, tolerance, gap.mean[c, o] / tolerance, covariances, kernels.discrepancy(), kernels.detail
        )

    def only(self, rows: Rows) -> Self:
        """The cells of some configurations (by their place in the gap table)."""
        kept = np.flatnonzero(np.isin(self.configuration, rows))
        pair = np.ix_(kept, kept)
        return replace(
            self,
            configuration=self.configuration[kept],
            observable=self.observable[kept],
            tolerance=self.tolerance[kept],
            z=self.z[kept],
            covariances=self.covariances[:, pair[0], pair[1]],
            discrepancy=self.discrepancy[pair],
            detail=self.detail[kept],
        )

    def take(self, table: Floats) -> Floats:
        """(..., C, D) to (..., N), in tolerances; NaN where there is no answer."""
        return np.asarray(table[..., self.configuration, self.observable] / self.tolerance)


@dataclass(frozen=True, eq=False)
class InferenceProblem:
    """`blocks` by stage, and what simulates sets of the `laws`. `effects`: ids that some stage can show, in the order
    of the catalogue."""

    gap: GapTable
    blocks: tuple[StageBlock, ...]
    simulator: JointSimulator
    laws: tuple[EffectLaw, ...]

    @classmethod
    def of(cls, gap: GapTable, stages: Sequence[Stage], kinds: Sequence[type[Effect]]) -> Self:
        shown = {identity for stage in stages for identity in stage.shows}
        own = [kind for kind in kinds if kind.id in shown]
        owners = owners_of([configuration.factors for configuration in gap.record.configurations])
        ranges = _ranges(stages, own)
        laws = tuple(law for kind in own for law in laws_of(kind, ranges, _owners_of_kind(kind, owners, stages)))
        blocks = tuple(StageBlock.of(gap, stage) for stage in gap.stages)
        simulator = JointSimulator(stages, laws)
        simulator.negligible = negligible_places(simulator, gap.tolerance)
        return cls(gap, blocks, simulator, laws)

    @property
    def detectable(self) -> tuple[type[Effect], ...]:
        """All effects of the catalogue that some stage can show, whether they are looked for or not."""
        shown = {identity for stage in self.simulator.stages for identity in stage.shows}
        return tuple(kind for name, kind in catalogue().items() if name in shown)

    @property
    def effects(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(law.id for law in self.laws))

    def only(self, rows: Rows) -> Self:
        """Some of the configurations; the simulator still knows all."""
        return replace(self, blocks=tuple(block.only(rows) for block in self.blocks))

    def stage(self, name: str) -> Self:
        """One stage by itself, given what was measured at its entrance, with the laws that it shows."""
        shown = {identity for stage in self.simulator.stages if stage.name == name for identity in stage.shows}
        return replace(
            self,
            blocks=tuple(block for block in self.blocks if block.stage == name),
            laws=tuple(law for law in self.laws if law.id in shown),
        )

    def cell_levels(self, law: EffectLaw, block: StageBlock) -> Rows:
        """(N,): the level of a law's owner that each cell of a stage tells of; -1 for none."""
        parted = [stage for stage in self.simulator.stages if law.owner in stage.parts(law.kind)]
        if not parted:
            return np.asarray(np.array(law.levels)[block.configuration])
        levels = np.full(len(self.gap.observables), -1)
        for stage in parted:
            levels[self.gap.columns(stage.name)] = stage.part_of_observables(law.owner, law.level_names)
        return np.asarray(levels[block.observable])

    def changes(self, points: Sequence[Point]) -> list[Floats]:
        """By block (k, N): what each set changes, in tolerances; NaN where there is no answer."""
        table = self.simulator.changes(points, [block.stage for block in self.blocks])
        return [block.take(table) for block in self.blocks]


def _owners_of_kind(kind: type[Effect], owners: Owners, stages: Sequence[Stage]) -> Owners:
    """Parameters that the plate shows differ between its parts, all others between configurations: an array of values
    goes with the one or with the other."""
    plate = next((stage for stage in stages if stage.name == "plate" and kind.id in stage.shows), None)
    return owners if plate is None else plate.parts(kind)


def _noise(gap: GapTable, c: Rows, o: Rows) -> Floats:
    """(N, N): of means, from repetitions, and of nominal parameters that are declared uncertain."""
    number = gap.count[c, o].astype(np.float64)
    wider = np.broadcast_to(gap.noise.relative, gap.mean.shape)[c, o] / np.sqrt(number)
    noise = np.where(c[:, None] == c[None, :], gap.noise.covariance[np.ix_(o, o)] * np.outer(wider, wider), 0.0)
    nuisances = gap.nuisances[:, c, o]
    return np.asarray(noise + nuisances.T @ nuisances)


def _ranges(stages: Sequence[Stage], kinds: Sequence[type[Effect]]) -> LawRanges:
    """Where each parameter that spans orders of magnitude, alone, moves the gap of some stage by a tolerance."""
    smallest: dict[tuple[str, str], float] = {}
    for kind in kinds:
        for item in kind.parameters():
            if item.likely is None or item.likely[0] < item.off < item.likely[1]:
                continue
            end = item.likely[1] if item.off <= item.likely[1] else item.likely[0]
            values = end * _PROBES if item.off <= item.likely[1] else end / _PROBES
            off = {parameter.name: parameter.off for parameter in kind.parameters()}
            values = values[(values >= item.low) & (values <= item.high)]
            sets = [[kind(**{**off, item.name: float(value)})] for value in values]
            size = np.max([_sizes(stage, sets) for stage in stages if kind.id in stage.shows], axis=0)
            seen = np.flatnonzero(size > 1.0)
            if seen.size:
                smallest[kind.id, item.name] = float(values[seen.min()])
    return LawRanges(smallest)


def _sizes(stage: Stage, sets: Sequence[Sequence[Effect]]) -> Floats:
    """(k,): rms over configurations of the observable that moves most, in tolerances; 0 without an answer."""
    tolerance = np.array([item.tolerance for item in stage.observables])
    ratio = stage.changes(sets) / tolerance
    finite = np.isfinite(ratio)
    total = np.where(finite, ratio, 0.0) ** 2
    rms = np.sqrt(total.sum(axis=1) / np.maximum(finite.sum(axis=1), 1))
    return np.asarray(rms.max(axis=1))
