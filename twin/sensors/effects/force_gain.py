"""Gain error of the load cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ....array_types import Floats
from ...effects import Value, parameter
from ..effect import SensorEffect, along_first
from ..growing_gain import gain_at, growth_parameter, rate_of, up_to_turn, without_growing_gain

#: Force at which a gain that grows is the stated one, N: what the larger impacts of such benches
#: reach, since linearity is stated by the largest error of the range.
REFERENCE_N = 1e4


@dataclass(frozen=True)
class ForceGain(SensorEffect):
    """A sensitivity other than the certificate's; or force that reaches the target beside the cell
    (gain below 1).

    A cell that is not linear has a gain that changes with the force. `growth` is the change of its
    error over 10 kN, as a share of that at 10 kN: 0 of a wrong sensitivity, 1 of a characteristic
    that is right near zero and bends, more than 1 where the error changes its sign on the way.
    """

    id = "sensor.force_gain"
    law = "F_reading = gain^(1 + growth (F / (10 kN) - 1)) F"
    source = (
        "ISO 7626-5:2019, 7 (calibration of the force channel); JCGM 200:2012 (VIM), 4.12 "
        "sensitivity; interpolation error: ISO 376:2011"
    )

    # certificates err by a few per cent; a bolt that preloads the cell carries up to half of the
    # force
    gain: Value = parameter(
        "reading over true force, at 10 kN",
        "",
        default=1.03,
        low=0.2,
        high=5.0,
        off=1.0,
        likely=(0.5, 2.0),
        typical=0.03,
        owner="channel",
    )
    # How it acts, not whether. Likely, of a characteristic that bends: about that which is right
    # near zero, which is 1.
    growth: Value = growth_parameter("10 kN")
    regimes: ClassVar[tuple[tuple[str, ...], ...]] = (("gain",), ("gain", "growth"))

    def measured_force_n(self, force_n: Floats, dt_s: float) -> Floats:  # noqa: ARG002 - a hook
        gain, growth = along_first(self.gain, force_n), along_first(self.growth, force_n)
        true_n = up_to_turn(force_n, rate_of(gain, growth, REFERENCE_N))
        return np.asarray(true_n * gain_at(true_n, gain, growth, REFERENCE_N))

    def true_force_n(self, reading_n: Floats, dt_s: float) -> Floats:  # noqa: ARG002 - a hook
        steady_n = reading_n / self.gain ** (1 - self.growth)
        return without_growing_gain(steady_n, rate_of(self.gain, self.growth, REFERENCE_N))
