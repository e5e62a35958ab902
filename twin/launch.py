"""The stage of the gun: what the operator sets, to the velocity of impact."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..signals.valve_profile import ValveProfile
from .gun.bench import GunBench
from .gun.calibration import VelocityCalibration
from .gun.effect import GunEffect
from .sensors.chain import SensorChain
from .setting import Setting
from .strikes import Floats


@dataclass(frozen=True)
class GunStage:
    """A gun with effects; `velocity_spread` is the standard deviation of log(measured over predicted velocity).

    A calibration, what measured shots have taught, corrects the velocity and says its own spread at each setting.
    `source` says where the bench's numbers are from. Raises `ValueError` for a spread that is negative or not finite.
    """

    bench: GunBench
    velocity_spread: float
    effects: tuple[GunEffect, ...] = ()
    source: str = ""
    calibration: VelocityCalibration | None = None

    def __post_init__(self) -> None:
        if not (0 <= self.velocity_spread < math.inf):
            raise ValueError(f"velocity_spread = {self.velocity_spread!r}: expected 0 or more, finite")

    @property
    def label(self) -> str:
        """What answers: "eq. 2.16 (campaign spring)", and the effects' ids."""
        law = f"eq. 2.16 ({self.source})" if self.source else "eq. 2.16"
        taught = () if self.calibration is None else (f"{self.calibration.shots} measured shots",)
        return " + ".join((law, *taught, *(each.id for each in self.effects)))

    def velocities(self, settings: Sequence[Setting], sensors: SensorChain) -> Floats:
        """True velocities of impact (n,), m/s; 0 for a bullet that does not leave the barrel."""
        velocity = np.array([setting.impact_velocity_m_s or 0.0 for setting in settings], dtype=np.float64)
        fired, reading, mass = _shots(settings)
        if fired.size:
            profiles = [settings[row].valve_profile for row in fired]
            velocity[fired] = self.fired(sensors.true_pressure_pa(reading), mass, profiles)
            if self.calibration is not None:
                velocity[fired] *= self.calibration.factor(reading, mass)
        return velocity

    def spreads(self, settings: Sequence[Setting]) -> Floats:
        """Of the logarithm of each velocity, (n,); 0 where the velocity was given."""
        spread = np.zeros(len(settings))
        fired, reading, mass = _shots(settings)
        if fired.size:
            known = self.calibration
            spread[fired] = self.velocity_spread if known is None else known.spread(reading, mass)
        return spread

    def fired(
        self, tank_pressure_pa: Floats, bullet_mass_kg: Floats, profiles: Sequence[ValveProfile | None] | None = None
    ) -> Floats:
        """Velocities (n,) of true tank pressures and bullets, with the profile of each valve where it is stated."""
        from .gun.shots import gun_velocity

        shots = gun_velocity(self.bench, tank_pressure_pa, bullet_mass_kg, self.effects, valve_profiles=profiles)
        return shots.velocity_m_s


def _shots(settings: Sequence[Setting]) -> tuple[NDArray[np.intp], Floats, Floats]:
    """Which settings the gun fires, with readings of the tank (Pa, gauge) and masses (kg)."""
    shots = [
        (i, s.tank_pressure_pa, s.impactor_mass_kg) for i, s in enumerate(settings) if s.tank_pressure_pa is not None
    ]
    rows, reading, mass = np.array(shots, dtype=np.float64).reshape(-1, 3).T
    return rows.astype(np.intp), reading, mass
