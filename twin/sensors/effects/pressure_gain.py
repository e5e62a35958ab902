"""Gain error of the tank-pressure transducer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ....array_types import Floats
from ...effects import Value, parameter
from ..effect import SensorEffect
from ..growing_gain import gain_at, growth_parameter, rate_of, up_to_turn, without_growing_gain

#: Gauge pressure at which a gain that grows is the stated one, Pa: what the larger shots of such
#: guns are made with, since data sheets state linearity by the largest error of the range.
REFERENCE_PA = 2.5e5


@dataclass(frozen=True)
class PressureGain(SensorEffect):
    """The operator sets the reading, so the tank holds the reading over the gain.

    A transducer that is not linear has a gain that changes with what it reads. `growth` is the
    change of its error over
    2.5 bar, as a share of that at 2.5 bar: 0 of a wrong range or shunt, 1 of a characteristic that
    is right near zero and bends (zero-based linearity), more than 1 where the error changes its
    sign on the way (independent linearity).
    """

    id = "sensor.pressure_gain"
    law = "p_reading = gain^(1 + growth (p_reading / 2.5 bar - 1)) p"
    source = (
        "JCGM 200:2012 (VIM), 4.12 sensitivity; Doebelin, Measurement Systems, 5th ed. 2003, ch. "
        "3.3; zero-based and independent linearity: IEC 61298-2:2008, ISA-37.1-1975 (R1982)"
    )

    # Likely: a wrong range or shunt, seldom a fifth; larger errors are units, which plausibility
    # tells.
    gain: Value = parameter(
        "reading over true pressure, at a reading of 2.5 bar",
        "",
        default=1.02,
        low=0.5,
        high=2.0,
        off=1.0,
        likely=(0.8, 1.25),
        typical=0.01,
        owner="channel",
    )
    # How it acts, not whether. Likely, of a characteristic that bends: about zero-based, which is
    # 1.
    growth: Value = growth_parameter("2.5 bar")
    regimes: ClassVar[tuple[tuple[str, ...], ...]] = (("gain",), ("gain", "growth"))

    def true_pressure_pa(self, reading_pa: Floats) -> Floats:
        read_pa = up_to_turn(reading_pa, -rate_of(self.gain, self.growth, REFERENCE_PA))
        return np.asarray(read_pa / gain_at(read_pa, self.gain, self.growth, REFERENCE_PA))

    def measured_pressure_pa(self, pressure_pa: Floats) -> Floats:
        steady_pa = pressure_pa * self.gain ** (1 - self.growth)
        return without_growing_gain(steady_pa, -rate_of(self.gain, self.growth, REFERENCE_PA))
