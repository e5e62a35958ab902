"""Offset of the tank-pressure transducer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ....array_types import Floats
from ...effects import Value, parameter
from ..effect import SensorEffect


@dataclass(frozen=True)
class PressureOffset(SensorEffect):
    """The operator sets the reading, so the tank holds less by the offset; never less than the
    atmosphere.

    A transducer whose span was set at the upper end of its range reads that right and an open tank
    wrong: the error falls evenly to nothing at 1 / `fading_1_pa` (a terminal of IEC 61298-2).
    """

    id = "sensor.pressure_offset"
    law = "p_reading = p + offset (1 - fading p)"
    source = (
        "JCGM 200:2012 (VIM), 4.20 datum measurement error; Doebelin, Measurement Systems, 5th ed. "
        "2003, ch. 3.3; zero and span adjustment, terminal-based errors: IEC 61298-2:2008"
    )
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
    # How it acts, not whether. Likely: set right at the end of the usual ranges, 1.6 to 10 bar (EN
    # 837-1, 8.2).
    fading_1_pa: Value = parameter(
        "share of the offset that is gone, per pressure",
        "1/Pa",
        default=0.0,
        low=0.0,
        high=8e-6,
        off=0.0,
        likely=(1e-6, 6.25e-6),
        owner="channel",
    )
    regimes: ClassVar[tuple[tuple[str, ...], ...]] = (("offset_pa",), ("offset_pa", "fading_1_pa"))

    def true_pressure_pa(self, reading_pa: Floats) -> Floats:
        pressure_pa = (reading_pa - self.offset_pa) / (1 - self.offset_pa * self.fading_1_pa)
        return np.asarray(np.maximum(pressure_pa, 0.0))

    def measured_pressure_pa(self, pressure_pa: Floats) -> Floats:
        return np.asarray(pressure_pa + self.offset_pa * (1 - self.fading_1_pa * pressure_pa))
