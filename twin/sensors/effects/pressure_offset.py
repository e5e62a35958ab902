"""Offset of the tank-pressure transducer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....array_types import Floats
from ...effects import Value, parameter
from ..effect import SensorEffect


@dataclass(frozen=True)
class PressureOffset(SensorEffect):
    """The operator sets the reading, so the tank holds less by the offset; never less than the atmosphere."""

    id = "sensor.pressure_offset"
    law = "p_reading = p + offset"
    source = "JCGM 200:2012 (VIM), 4.20 datum measurement error; Doebelin, Measurement Systems, 5th ed. 2003, ch. 3.3"
    place = 3

    # Likely: a few percent of the span of a transducer for 10 bar.
    offset_pa: Value = parameter(
        "reading at an open tank",
        "Pa",
        default=5e3,
        low=-1e5,
        high=1e5,
        off=0.0,
        likely=(-30e3, 30e3),
        typical=3e3,
        owner="channel",
    )

    def true_pressure_pa(self, reading_pa: Floats) -> Floats:
        return np.asarray(np.maximum(reading_pa - self.offset_pa, 0.0))
