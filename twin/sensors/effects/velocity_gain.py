"""Gain error of the velocity measurement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ....array_types import Floats
from ...effects import Value, parameter
from ..effect import SensorEffect
from ..growing_gain import gain_at, growth_parameter, rate_of, up_to_turn, without_growing_gain

#: Velocity at which a gain that grows is the stated one, m/s: what the larger shots of such guns
#: reach, since linearity is stated by the largest error of the range.
REFERENCE_M_S = 25.0


@dataclass(frozen=True)
class VelocityGain(SensorEffect):
    """u = L / t: a relative error of the projectile's length, or of the laser's timing, is one of
    the velocity.

    A timer that starts late by dt in all shots has a relative error of velocity that grows with it,
    dt u / L. `growth` is the change of the error over 25 m/s, as a share of that at 25 m/s: 0 of a
    length, 1 of a late timer.
    """

    id = "sensor.velocity_gain"
    law = "u_reading = gain^(1 + growth (u / (25 m/s) - 1)) u"
    source = (
        "thesis, eq. 5.2: u = L / t, length known to 1 mm of 85 mm; JCGM 100:2008 (GUM), 5.1; "
        "zero-based and independent linearity: IEC 61298-2:2008"
    )

    # a light gate's spacing or a projectile's effective length is wrong by a few per cent, by a
    # quarter at worst
    gain: Value = parameter(
        "reading over true velocity, at 25 m/s",
        "",
        default=1.012,
        low=0.5,
        high=2.0,
        off=1.0,
        likely=(0.75, 1.33),
        typical=0.012,
        owner="channel",
    )
    # How it acts, not whether. Likely: about that of a late timer, which is 1, with an error of
    # length beside it.
    growth: Value = growth_parameter("25 m/s")
    regimes: ClassVar[tuple[tuple[str, ...], ...]] = (("gain",), ("gain", "growth"))

    def measured_velocity_m_s(self, velocity_m_s: Floats) -> Floats:
        true_m_s = up_to_turn(velocity_m_s, rate_of(self.gain, self.growth, REFERENCE_M_S))
        return np.asarray(true_m_s * gain_at(true_m_s, self.gain, self.growth, REFERENCE_M_S))

    def true_velocity_m_s(self, reading_m_s: Floats) -> Floats:
        steady_m_s = reading_m_s / self.gain ** (1 - self.growth)
        return without_growing_gain(steady_m_s, rate_of(self.gain, self.growth, REFERENCE_M_S))
