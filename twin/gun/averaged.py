"""A gun whose effects are not told apart: the mean of what several guns predict, by their
probabilities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from ...array_types import Floats
from ...signals.valve_profile import ValveProfile
from ..sensors.chain import SensorChain
from ..setting import Setting
from .stage import GunStage


@dataclass(frozen=True)
class AveragedGunStage(GunStage):
    """The stage of several guns with their weights, of sum one; what else the stage knows is the
    likeliest one's.

    Velocities are the mean over the guns of those whose bullet leaves the barrel; a random shot is
    one of one gun, so that the bands hold what the guns differ by. Raises `ValueError` for fewer
    than two guns and for weights that are not positive or do not sum to one.
    """

    guns: tuple[tuple[float, GunStage], ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        weights = [weight for weight, _ in self.guns]
        if len(weights) < 2 or not min(weights) > 0 or abs(sum(weights) - 1) > 1e-6:
            raise ValueError(f"weights = {weights!r}: expected two or more, positive, of sum one")

    @classmethod
    def of(cls, guns: Sequence[tuple[float, GunStage]]) -> Self:
        """Raises as the class."""
        first = max(guns, key=lambda pair: pair[0])[1] if guns else None
        if first is None:
            raise ValueError("no guns: expected two or more")
        same = (
            first.bench,
            first.velocity_spread,
            first.effects,
            first.source,
            first.unknown_effects,
            first.shots,
        )
        return cls(*same, guns=tuple(guns))

    @property
    def label(self) -> str:
        names = [
            " + ".join(effect.id for effect in gun.effects) or "no effect" for _, gun in self.guns
        ]
        return (
            f"{replace(self.guns[0][1], effects=()).label} + mean of "
            f"{', '.join(names[:-1])} and {names[-1]}"
        )

    @property
    def normals(self) -> int:
        """Those of a gun, and one that says which gun it is."""
        return super().normals + 1

    def velocities(self, settings: Sequence[Setting], sensors: SensorChain) -> Floats:
        return self._mean([gun.velocities(settings, sensors) for _, gun in self.guns])

    def velocity_draws(
        self, settings: Sequence[Setting], sensors: SensorChain, z: Floats
    ) -> Floats:
        from scipy.special import ndtr

        ends = np.cumsum([weight for weight, _ in self.guns])
        member = np.minimum(np.searchsorted(ends, ndtr(z[:, -1])), len(ends) - 1)
        velocity = np.zeros((len(z), len(settings)))
        for place, (_, gun) in enumerate(self.guns):
            rows = np.flatnonzero(member == place)
            if rows.size:
                velocity[rows] = gun.velocity_draws(settings, sensors, z[rows, :-1])
        return velocity

    def leaving(self, settings: Sequence[Setting], sensors: SensorChain) -> Floats:
        return np.asarray(sum(weight * gun.leaving(settings, sensors) for weight, gun in self.guns))

    def fired(
        self, tank_pressure_pa: Floats, bullet_mass_kg: Floats, profile: ValveProfile | None = None
    ) -> Floats:
        return self._mean(
            [gun.fired(tank_pressure_pa, bullet_mass_kg, profile) for _, gun in self.guns]
        )

    def updated(
        self,
        tank_pressure_pa: ArrayLike,
        bullet_mass_kg: ArrayLike,
        measured_m_s: ArrayLike,
        measured_u_m_s: ArrayLike | None = None,
    ) -> AveragedGunStage:
        shots = (tank_pressure_pa, bullet_mass_kg, measured_m_s, measured_u_m_s)
        return self.of([(weight, gun.updated(*shots)) for weight, gun in self.guns])

    def _mean(self, velocities: Sequence[Floats]) -> Floats:
        """(n,): over the guns that fire the bullet; 0 where none does."""
        weight = np.array([[weight] for weight, _ in self.guns]) * (np.array(velocities) > 0)
        total = weight.sum(axis=0)
        return np.asarray((weight * velocities).sum(axis=0) / np.where(total > 0, total, 1.0))
