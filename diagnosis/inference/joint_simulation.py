"""What sets of effects do to everything that a campaign shows, simulated together: effects do not add up."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...array_types import Floats
from ...twin.effects import Effect
from ..observables.base import Stage
from .effect_laws import EffectLaw

#: A set of laws, each with its numbers u.
Point = tuple[tuple[EffectLaw, Floats], ...]
#: Simulations of one stage that are kept; the oldest go first.
_MOST_KEPT = 6000
#: Stages that simulate sets of the same effects in one batch: to them every set is given with all effects.
_BATCHED = ("gun", "contact")


@dataclass(eq=False)
class JointSimulator:
    """The stages of a campaign, asked for many sets of effects at once; nothing is simulated twice.

    `negligible`: by law key, numbers u (first coordinate, common part) below which an effect moves nothing by a
    twentieth of a tolerance. It is not simulated there: an effect near its off value costs nothing.
    """

    stages: Sequence[Stage]
    laws: Sequence[EffectLaw]
    negligible: Mapping[str, float] = field(default_factory=dict)
    count: int = 0
    _kept: dict[tuple[object, ...], Floats] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, int]:
        """C configurations and D observables of all stages."""
        return len(self.stages[0].record.configurations), sum(len(stage.observables) for stage in self.stages)

    def changes(self, points: Sequence[Point], stages: Collection[str] | None = None) -> Floats:
        """(k, C, D): by how much each set moves the nominal observables; NaN where there is no answer, 0 in stages that
        are not asked for."""
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
        acting = [tuple(pair for pair in point if pair[0].id in shown and self._acts(*pair)) for point in points]
        keys = [(stage.name, *((law.key, u.tobytes()) for law, u in point)) for point in acting]
        missing = {key: point for key, point in zip(keys, acting, strict=True) if key not in self._kept}
        if missing:
            self.count += len(missing)
            sets = [self._effects(stage, point) for point in missing.values()]
            for key, table in zip(missing, stage.changes(sets), strict=True):
                self._kept[key] = table
        result = np.stack([self._kept[key] for key in keys])
        while len(self._kept) > _MOST_KEPT:
            self._kept.pop(next(iter(self._kept)))
        return result

    def _acts(self, law: EffectLaw, u: Floats) -> bool:
        least = self.negligible.get(law.key)
        return least is None or bool(u[0] > least)

    def _effects(self, stage: Stage, point: Point) -> list[Effect]:
        effects = {law.id: law.effect(u) for law, u in point}
        if stage.name in _BATCHED and point:
            return list({**self._off[stage.name], **effects}.values())
        return list(effects.values())

    @cached_property
    def _shown(self) -> dict[str, set[str]]:
        return {stage.name: set(stage.shows) for stage in self.stages}

    @cached_property
    def _off(self) -> dict[str, dict[str, Effect]]:
        """By stage, every effect of its own doing nothing."""
        return {
            name: {law.id: law.off() for law in self.laws if law.id in shown} for name, shown in self._shown.items()
        }


def negligible_places(simulator: JointSimulator, tolerance: Floats) -> dict[str, float]:
    """By law key, for laws whose first parameter grows from nothing: the largest u, from -4 up, at which the
    law moves no observable by a twentieth of its tolerance (D,)."""
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
