"""Gain error of the tank-pressure transducer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....array_types import Floats
from ...effects import Value, parameter
from ..effect import SensorEffect


@dataclass(frozen=True)
class PressureGain(SensorEffect):
    """The operator sets the reading, so the tank holds the reading over the gain."""

    id = "sensor.pressure_gain"
    law = "p_reading = gain p"
    source = "JCGM 200:2012 (VIM), 4.12 sensitivity; Doebelin, Measurement Systems, 5th ed. 2003, ch. 3.3"

    # Likely: a wrong range or shunt, seldom a fifth; larger errors are units, which plausibility tells.
    gain: Value = parameter(
        "reading over true pressure",
        "",
        default=1.02,
        low=0.5,
        high=2.0,
        off=1.0,
        likely=(0.8, 1.25),
        typical=0.01,
        owner="channel",
    )

    def true_pressure_pa(self, reading_pa: Floats) -> Floats:
        return np.asarray(reading_pa / self.gain)
