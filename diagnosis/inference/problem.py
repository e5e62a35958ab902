"""A campaign's gap as an inference problem: cells in tolerances, their covariances, the simulator
of all effects.

What sets of effects do to everything that a campaign shows, simulated together: effects do not add
up.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats, Rows
from ...twin.effects import Effect, catalogue
from ..gap import GapTable
from ..observables.base import Stage
from .effect_laws import EffectLaw, LawRanges, Owners, laws_of, owners_of
from .model_error import ErrorKernels, bank, usual_background

#: A set of laws, each with its numbers u.
Point = tuple[tuple[EffectLaw, Floats], ...]
#: What a set is to a stage: the stage's name, then each law's key and the bytes of its u.
_SetKey = tuple[Any, ...]
#: Simulations of one stage that are kept; the oldest go first.
_MOST_KEPT = 6000
#: Stages that simulate sets of the same effects in one batch: to them every set is given with all
#: effects.
_BATCHED = ("gun", "contact")


@dataclass(eq=False)
class JointSimulator:
    """The stages of a campaign, asked for many sets of effects at once; nothing is simulated twice.

    `negligible`: by law key, numbers u (first coordinate, common part) below which an effect moves
    nothing by a twentieth of a tolerance. It is not simulated there: an effect near its off value
    costs nothing.
    """

    stages: Sequence[Stage]
    laws: Sequence[EffectLaw]
    negligible: Mapping[str, float] = field(default_factory=dict)
    count: int = 0
    _kept: dict[_SetKey, Floats] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, int]:
        """C configurations and D observables of all stages."""
        return len(self.stages[0].record.configurations), sum(
            len(stage.observables) for stage in self.stages
        )

    def changes(self, points: Sequence[Point], stages: Collection[str] | None = None) -> Floats:
        """(k, C, D): by how much each set moves the nominal observables; NaN where there is no
        answer, 0 in stages that are not asked for.

        Parameters:
            points: The k sets of laws, each law with its numbers u.
            stages: Names of the stages that are asked for; by default all.
        """
        if not points:
            return np.zeros((0, *self.shape))
        tables = [
            self._stage_changes(stage, points)
            if stages is None or stage.name in stages
            else np.zeros((len(points), self.shape[0], len(stage.observables)))
            for stage in self.stages
        ]
        return np.concatenate(tables, axis=2)

    def _stage_changes(self, stage: Stage, points: Sequence[Point]) -> Floats:
        shown = self._shown[stage.name]
        acting = [
            tuple(pair for pair in point if pair[0].id in shown and self._acts(*pair))
            for point in points
        ]
        keys: list[_SetKey] = [
            (stage.name, *((law.key, u.tobytes()) for law, u in point)) for point in acting
        ]
        missing = {
            key: point for key, point in zip(keys, acting, strict=True) if key not in self._kept
        }
        if missing:
            self.count += len(missing)
            sets = self._effects(stage, missing)
            for key, table in zip(missing, stage.changes(sets), strict=True):
                self._kept[key] = table
        result = np.stack([self._kept[key] for key in keys])
        while len(self._kept) > _MOST_KEPT:
            self._kept.pop(next(iter(self._kept)))
        return result

    def _acts(self, law: EffectLaw, u: Floats) -> bool:
        least = self.negligible.get(law.key)
        return least is None or bool(u[0] > least)

    def _effects(self, stage: Stage, points: Mapping[_SetKey, Point]) -> list[list[Effect]]:
        """The effects of each set. Sets have most laws at the same u in common."""
        laws_and_places = {
            name: pair
            for key, point in points.items()
            for name, pair in zip(key[1:], point, strict=True)
        }
        effects = {name: law.effect(u) for name, (law, u) in laws_and_places.items()}
        off = self._off[stage.name] if stage.name in _BATCHED else {}
        sets = []
        for key in points:
            effects_by_id = {effect.id: effect for effect in map(effects.__getitem__, key[1:])}
            sets.append(
                list(({**off, **effects_by_id} if effects_by_id else effects_by_id).values())
            )
        return sets

    @cached_property
    def _shown(self) -> dict[str, set[str]]:
        return {stage.name: set(stage.shows) for stage in self.stages}

    @cached_property
    def _off(self) -> dict[str, dict[str, Effect]]:
        """By stage, every effect of its own doing nothing."""
        return {
            name: {law.id: law.off() for law in self.laws if law.id in shown}
            for name, shown in self._shown.items()
        }


def negligible_places(simulator: JointSimulator, tolerance: Floats) -> dict[str, float]:
    """By law key, for laws whose first parameter grows from nothing: the largest u, from -4 up, at
    which the law moves no observable by a twentieth of its tolerance.

    Parameters:
        simulator: What simulates the laws.
        tolerance: The tolerance of each observable (D,), in its unit.
    """
    places = np.linspace(-4.0, 0.0, 9)
    laws = [law for law in simulator.laws if law.coordinates[0].one_sided and not law.levels]
    negligible: dict[str, float] = {}
    for law in laws:
        points = []
        for place in places:
            u = np.zeros(law.size)
            u[0] = place
            points.append(((law, u),))
        with np.errstate(invalid="ignore"):
            size = np.nanmax(np.abs(simulator.changes(points)) / tolerance, axis=(1, 2))
        small = np.flatnonzero(size < 0.05)
        if small.size:
            negligible[law.key] = float(places[small[-1]])
    return negligible


#: A cell in which a set of effects has no answer (a shot that stays in the barrel) is off by so
#: many tolerances.
NO_ANSWER = 30.0
#: Variance, in tolerances squared: no simulator is better than a seventh of its tolerance anywhere.
_LEAST = 0.02
#: Values at which a parameter is tried for where it begins to be seen, as shares of its likely end.
_PROBES = np.geomspace(1e-5, 1.0, 16)


@dataclass(frozen=True, eq=False)
class StageBlock:
    """The N cells of one stage. `z` (N,) is the gap in tolerances; `covariances` (B, N, N) what
    repetitions, uncertain nominal parameters and each background of the bank leave in it;
    `discrepancy` (N, N) how a law's errors go together; `detail` (N,) which cells are a detail of
    shape or timing; `usual`: the place of a usual background. `factors`: the Cholesky factors of
    the covariances that were asked for last (see `subset_fit.covariance_factor`).
    """

    stage: str
    configuration: Rows
    observable: Rows
    tolerance: Floats
    z: Floats
    covariances: Floats
    discrepancy: Floats
    detail: NDArray[np.bool_]
    usual: int = 0
    factors: dict[Hashable, Floats] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def of(cls, gap: GapTable, stage: str) -> Self:
        """The cells of a stage that have a measured value.

        Parameters:
            gap: The gap of the campaign.
            stage: The name of the stage.
        """
        columns = np.zeros(len(gap.observables), dtype=bool)
        columns[gap.columns(stage)] = True
        c, o = np.nonzero((gap.count > 0) & columns[None, :])
        tolerance = gap.tolerance[o]
        factors = [configuration.factors for configuration in gap.record.configurations]
        kernels = ErrorKernels.of(factors, gap.observables, c, o)
        noise = _noise(gap, c, o) / np.outer(tolerance, tolerance) + _LEAST * np.eye(len(c))
        covariances = np.stack([noise + kernels.background(member) for member in bank(stage)])
        z, usual = gap.mean[c, o] / tolerance, usual_background(stage)
        return cls(
            stage, c, o, tolerance, z, covariances, kernels.discrepancy(), kernels.detail, usual
        )

    def only(self, rows: Rows) -> Self:
        """The cells of some configurations.

        Parameters:
            rows: The places of the configurations in the gap table.
        """
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
        """The cells (..., N) of tables, in tolerances; NaN where there is no answer.

        Parameters:
            table: Tables (..., C, D) in the units of the observables.
        """
        return np.asarray(table[..., self.configuration, self.observable] / self.tolerance)


@dataclass(frozen=True, eq=False)
class InferenceProblem:
    """`blocks` by stage, and what simulates sets of the `laws`, which were made of the `ranges`.
    `effects`: ids that some stage can show, in the order of the catalogue."""

    gap: GapTable
    blocks: tuple[StageBlock, ...]
    simulator: JointSimulator
    laws: tuple[EffectLaw, ...]
    ranges: LawRanges = field(default_factory=LawRanges)

    @classmethod
    def of(cls, gap: GapTable, stages: Sequence[Stage], kinds: Sequence[type[Effect]]) -> Self:
        """The problem that the gap of a campaign poses.

        Parameters:
            gap: The gap of the campaign.
            stages: The stages whose gap it is.
            kinds: The classes of the effects that are looked for; those that no stage can show are
                left out.
        """
        shown = {identity for stage in stages for identity in stage.shows}
        own = [kind for kind in kinds if kind.id in shown]
        owners = owners_of([configuration.factors for configuration in gap.record.configurations])
        facts = {(fact.effect, fact.parameter): fact for fact in gap.record.known_facts}
        ranges = replace(_ranges(stages, own), known_facts=facts)
        laws = tuple(
            law
            for kind in own
            for law in laws_of(kind, ranges, _owners_of_kind(kind, owners, stages))
        )
        blocks = tuple(StageBlock.of(gap, stage) for stage in gap.stages)
        simulator = JointSimulator(stages, laws)
        simulator.negligible = negligible_places(simulator, gap.tolerance)
        return cls(gap, blocks, simulator, laws, ranges)

    @property
    def detectable(self) -> tuple[type[Effect], ...]:
        """All effects of the catalogue that some stage can show, whether they are looked for or
        not."""
        shown = {identity for stage in self.simulator.stages for identity in stage.shows}
        return tuple(kind for name, kind in catalogue().items() if name in shown)

    @property
    def effects(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(law.id for law in self.laws))

    def only(self, rows: Rows) -> Self:
        """The problem of some of the configurations; the simulator still knows all.

        Parameters:
            rows: The places of the configurations in the gap table.
        """
        return replace(self, blocks=tuple(block.only(rows) for block in self.blocks))

    def stage(self, name: str) -> Self:
        """One stage by itself, given what was measured at its entrance, with the laws that it
        shows.

        Parameters:
            name: The name of the stage.
        """
        shown = {
            identity
            for stage in self.simulator.stages
            if stage.name == name
            for identity in stage.shows
        }
        return replace(
            self,
            blocks=tuple(block for block in self.blocks if block.stage == name),
            laws=tuple(law for law in self.laws if law.id in shown),
        )

    def cell_levels(self, law: EffectLaw, block: StageBlock) -> Rows:
        """(N,): the level of a law's owner that each cell of a stage tells of; -1 for none.

        Parameters:
            law: A law with a value for each level of its owner.
            block: The cells of the stage.
        """
        parted = [stage for stage in self.simulator.stages if law.owner in stage.parts(law.kind)]
        if not parted:
            return np.asarray(np.array(law.levels)[block.configuration])
        levels = np.full(len(self.gap.observables), -1)
        for stage in parted:
            levels[self.gap.columns(stage.name)] = stage.part_of_observables(
                law.owner, law.level_names
            )
        return np.asarray(levels[block.observable])

    def changes(self, points: Sequence[Point]) -> list[Floats]:
        """By block (k, N): what each set changes, in tolerances; NaN where there is no answer.

        Parameters:
            points: The k sets of laws, each law with its numbers u.
        """
        table = self.simulator.changes(points, [block.stage for block in self.blocks])
        return [block.take(table) for block in self.blocks]


def _owners_of_kind(kind: type[Effect], owners: Owners, stages: Sequence[Stage]) -> Owners:
    """Parameters that the plate shows differ between its parts, all others between configurations:
    an array of values goes with the one or with the other."""
    plate = next(
        (stage for stage in stages if stage.name == "plate" and kind.id in stage.shows), None
    )
    return owners if plate is None else plate.parts(kind)


def _noise(gap: GapTable, c: Rows, o: Rows) -> Floats:
    """(N, N): of means, from repetitions, and of nominal parameters that are declared uncertain."""
    number = gap.count[c, o].astype(np.float64)
    wider = np.broadcast_to(gap.noise.relative, gap.mean.shape)[c, o] / np.sqrt(number)
    noise = np.where(
        c[:, None] == c[None, :], gap.noise.covariance[np.ix_(o, o)] * np.outer(wider, wider), 0.0
    )
    nuisances = gap.nuisances[:, c, o]
    return np.asarray(noise + nuisances.T @ nuisances)


def _ranges(stages: Sequence[Stage], kinds: Sequence[type[Effect]]) -> LawRanges:
    """Where each parameter that spans orders of magnitude, alone, moves the gap of some stage by a
    tolerance."""
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
            size = np.max(
                [_sizes(stage, sets) for stage in stages if kind.id in stage.shows], axis=0
            )
            seen = np.flatnonzero(size > 1.0)
            if seen.size:
                smallest[kind.id, item.name] = float(values[seen.min()])
    return LawRanges(smallest)


def _sizes(stage: Stage, sets: Sequence[Sequence[Effect]]) -> Floats:
    """(k,): rms over configurations of the observable that moves most, in tolerances; 0 without an
    answer."""
    tolerance = np.array([item.tolerance for item in stage.observables])
    ratio = stage.changes(sets) / tolerance
    finite = np.isfinite(ratio)
    total = np.where(finite, ratio, 0.0) ** 2
    rms = np.sqrt(total.sum(axis=1) / np.maximum(finite.sum(axis=1), 1))
    return np.asarray(rms.max(axis=1))
