"""The measuring chain: the sensors' effects in the order in which a signal passes them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import reduce
from typing import Self

import numpy as np

from ...array_types import Complexes, Floats
from ..effects import Effect, checked_effects
from .effect import SensorEffect


@dataclass(frozen=True)
class SensorChain:
    """What records show of what happened; without effects, just that.

    Effects act by their `place`: mount, sensing element, gain, the rest; of one place in the order
    of their ids.
    """

    effects: tuple[SensorEffect, ...] = ()

    @classmethod
    def of(cls, effects: Iterable[Effect] = ()) -> Self:
        """Raises `TypeError` for effects of another stage, `ValueError` for one given twice."""
        given = checked_effects(effects, SensorEffect)
        return cls(tuple(sorted(given, key=lambda each: (each.place, each.id))))

    def true_pressure_pa(self, reading_pa: Floats) -> Floats:
        """Gauge pressures from readings: the chain walked backwards."""
        return reduce(
            lambda value, each: each.true_pressure_pa(value), reversed(self.effects), reading_pa
        )

    def measured_pressure_pa(self, pressure_pa: Floats) -> Floats:
        """Readings of gauge pressures, below nothing too."""
        return reduce(
            lambda value, each: each.measured_pressure_pa(value), self.effects, pressure_pa
        )

    def measured_velocity_m_s(self, velocity_m_s: Floats) -> Floats:
        return reduce(
            lambda value, each: each.measured_velocity_m_s(value), self.effects, velocity_m_s
        )

    def true_velocity_m_s(self, reading_m_s: Floats) -> Floats:
        """Velocities from readings: the chain walked backwards."""
        return reduce(
            lambda value, each: each.true_velocity_m_s(value), reversed(self.effects), reading_m_s
        )

    def measured_force_n(self, force_n: Floats, dt_s: float) -> Floats:
        """(..., n) in steps of `dt_s`."""
        return reduce(lambda value, each: each.measured_force_n(value, dt_s), self.effects, force_n)

    def true_force_n(self, reading_n: Floats, dt_s: float) -> Floats:
        """Forces from readings (n,) in steps of `dt_s`: the chain walked backwards."""
        return reduce(
            lambda value, each: each.true_force_n(value, dt_s), reversed(self.effects), reading_n
        )

    def measured_acceleration_m_s2(self, acceleration_m_s2: Floats, dt_s: float) -> Floats:
        """(..., n) in steps of `dt_s`."""
        return reduce(
            lambda value, each: each.measured_acceleration_m_s2(value, dt_s),
            self.effects,
            acceleration_m_s2,
        )

    def transmissibility(self, poles: Complexes) -> Complexes:
        """(k, K), or (1, K) where all sensors are alike: what it shows of accelerations exp(lambda
        t), `poles` (K,).

        Effects without a closed form have no part in it.
        """
        unit = np.ones((1, poles.size), dtype=np.complex128)
        return reduce(lambda value, each: each.measured_amplitude(value, poles), self.effects, unit)
