"""Gain error of the load cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....array_types import Floats
from ...effects import Value, parameter
from ..effect import SensorEffect, along_first


@dataclass(frozen=True)
class ForceGain(SensorEffect):
    """A sensitivity other than the certificate's; or force that reaches the target beside the cell (gain below 1)."""

    id = "sensor.force_gain"
    law = "F_reading = gain F"
    source = "ISO 7626-5:2019, 7 (calibration of the force channel); JCGM 200:2012 (VIM), 4.12 sensitivity"

    # certificates err by a few per cent; a bolt that preloads the cell carries up to half of the force
    gain: Value = parameter(
        "reading over true force",
        "",
        default=1.03,
        low=0.2,
        high=5.0,
        off=1.0,
        likely=(0.5, 2.0),
        typical=0.03,
        owner="channel",
    )

    def measured_force_n(self, force_n: Floats, dt_s: float) -> Floats:  # noqa: ARG002 - a hook
        return np.asarray(force_n * along_first(self.gain, force_n))

    def true_force_n(self, reading_n: Floats, dt_s: float) -> Floats:  # noqa: ARG002 - a hook
        return np.asarray(reading_n / self.gain)
