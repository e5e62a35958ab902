"""Gain error of the velocity measurement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....array_types import Floats
from ...effects import Value, parameter
from ..effect import SensorEffect


@dataclass(frozen=True)
class VelocityGain(SensorEffect):
    """u = L / t: a relative error of the projectile's length, or of the laser's timing, is one of the velocity."""

    id = "sensor.velocity_gain"
    law = "u_reading = gain u"
    source = "thesis, eq. 5.2: u = L / t, length known to 1 mm of 85 mm; JCGM 100:2008 (GUM), 5.1"

    # a light gate's spacing or a projectile's effective length is wrong by a few per cent, by a quarter at worst
    gain: Value = parameter(
        "reading over true velocity",
        "",
        default=1.012,
        low=0.5,
        high=2.0,
        off=1.0,
        likely=(0.75, 1.33),
        typical=0.012,
        owner="channel",
    )

    def measured_velocity_m_s(self, velocity_m_s: Floats) -> Floats:
        return np.asarray(velocity_m_s * self.gain)
