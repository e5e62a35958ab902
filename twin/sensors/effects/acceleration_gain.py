"""Gain error of an accelerometer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....array_types import Complexes, Floats
from ...effects import Value, parameter
from ..effect import SensorEffect, along_first


@dataclass(frozen=True)
class AccelerationGain(SensorEffect):
    """A sensitivity other than the certificate's, at every level and frequency."""

    id = "sensor.acceleration_gain"
    law = "a_reading = gain a"
    source = "ISO 16063-1:1998 (calibration of accelerometers); JCGM 200:2012 (VIM), 4.12 sensitivity"

    # Some per cent for a certificate that is old, up to 3 dB for a wrong setting of the amplifier (ISO 16063-1).
    gain: Value = parameter(
        "reading over true acceleration",
        "",
        default=1.05,
        low=0.2,
        high=5.0,
        off=1.0,
        likely=(0.7, 1.4),
        typical=0.03,
        owner="channel",
    )

    def measured_acceleration_m_s2(self, acceleration_m_s2: Floats, dt_s: float) -> Floats:  # noqa: ARG002 - a hook
        return np.asarray(acceleration_m_s2 * along_first(self.gain, acceleration_m_s2))

    def measured_amplitude(self, amplitude: Complexes, poles: Complexes) -> Complexes:  # noqa: ARG002 - a hook
        return np.asarray(amplitude * np.reshape(self.gain, (-1, 1)))
