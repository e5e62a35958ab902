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
        """The chain of some effects, in the order in which they act.

        Parameters:
            effects: Effects of the sensors in any order; none by default.

        Raises:
            TypeError: For effects of another stage.
            ValueError: For one given twice.
        """
        given = checked_effects(effects, SensorEffect)
        return cls(tuple(sorted(given, key=lambda each: (each.place, each.id))))

    def true_pressure_pa(self, reading_pa: Floats) -> Floats:
        """Gauge pressures from readings: the effects are undone in reverse order.

        Parameters:
            reading_pa: What the transducer reads, an array of any shape.
        """
        return reduce(
            lambda value, each: each.true_pressure_pa(value), reversed(self.effects), reading_pa
        )

    def measured_pressure_pa(self, pressure_pa: Floats) -> Floats:
        """Readings of gauge pressures, which may be negative.

        Parameters:
            pressure_pa: Gauge pressures in the tank, an array of any shape.
        """
        return reduce(
            lambda value, each: each.measured_pressure_pa(value), self.effects, pressure_pa
        )

    def measured_velocity_m_s(self, velocity_m_s: Floats) -> Floats:
        """What the velocity measurement shows.

        Parameters:
            velocity_m_s: True velocities, an array of any shape.
        """
        return reduce(
            lambda value, each: each.measured_velocity_m_s(value), self.effects, velocity_m_s
        )

    def true_velocity_m_s(self, reading_m_s: Floats) -> Floats:
        """Velocities from readings: the effects are undone in reverse order.

        Parameters:
            reading_m_s: What the velocity measurement shows, an array of any shape.
        """
        return reduce(
            lambda value, each: each.true_velocity_m_s(value), reversed(self.effects), reading_m_s
        )

    def measured_force_n(self, force_n: Floats, dt_s: float) -> Floats:
        """What the force channel shows, (..., n).

        Parameters:
            force_n: True forces (..., n) in equal steps.
            dt_s: Length of a step.
        """
        return reduce(lambda value, each: each.measured_force_n(value, dt_s), self.effects, force_n)

    def true_force_n(self, reading_n: Floats, dt_s: float) -> Floats:
        """Forces from readings: the effects are undone in reverse order.

        Parameters:
            reading_n: What the force channel shows (n,), in equal steps.
            dt_s: Length of a step.
        """
        return reduce(
            lambda value, each: each.true_force_n(value, dt_s), reversed(self.effects), reading_n
        )

    def measured_acceleration_m_s2(self, acceleration_m_s2: Floats, dt_s: float) -> Floats:
        """What the accelerometers' channels show, (..., n).

        Parameters:
            acceleration_m_s2: True accelerations (..., n) in equal steps.
            dt_s: Length of a step.
        """
        return reduce(
            lambda value, each: each.measured_acceleration_m_s2(value, dt_s),
            self.effects,
            acceleration_m_s2,
        )

    def transmissibility(self, poles: Complexes) -> Complexes:
        """What the chain shows of accelerations exp(lambda t): (k, K), or (1, K) where all sensors
        are alike.

        Effects without a closed form have no part in it.

        Parameters:
            poles: lambda (K,), complex, 1/s.
        """
        unit = np.ones((1, poles.size), dtype=np.complex128)
        return reduce(lambda value, each: each.measured_amplitude(value, poles), self.effects, unit)
