"""Offset of the accelerometer after the shock, decaying slowly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....array_types import Floats
from ...effects import Value, parameter
from ..effect import SensorEffect, along_first


@dataclass(frozen=True)
class ZeroShift(SensorEffect):
    """From the largest acceleration on, t_p, a share of its size is left standing and decays."""

    id = "sensor.zero_shift"
    law = "a_reading = a + share max|a| exp(-(t - t_p) / tau) for t >= t_p"
    source = (
        "Chu, Zeroshift of piezoelectric accelerometers in pyroshock "
        "measurements, Shock Vib. Bull. 57 (1987)"
    )
    place = 1

    # Chu's accelerometers shift by up to 5 % of the shock, either way.
    share: Value = parameter(
        "offset over the largest acceleration",
        "",
        default=0.01,
        low=-1.0,
        high=1.0,
        off=0.0,
        likely=(-0.05, 0.05),
        owner="channel",
    )
    # Of the amplifier: the high-pass of a charge amplifier or IEPE supply, 0.2 to 3 Hz.
    decay_time_s: Value = parameter(
        "in which it falls to 1/e",
        "s",
        default=0.05,
        low=1e-4,
        high=1e3,
        off=0.05,
        likely=(0.05, 0.8),
        owner="channel",
    )

    def measured_acceleration_m_s2(self, acceleration_m_s2: Floats, dt_s: float) -> Floats:
        if not np.any(self.share):
            return acceleration_m_s2
        size = np.abs(acceleration_m_s2)
        at = np.argmax(size, axis=-1, keepdims=True)
        since = (np.arange(acceleration_m_s2.shape[-1]) - at) * dt_s
        decay = np.exp(-np.maximum(since, 0.0) / along_first(self.decay_time_s, acceleration_m_s2))
        peak = np.take_along_axis(size, at, axis=-1)
        offset = along_first(self.share, acceleration_m_s2) * peak * decay
        return np.asarray(acceleration_m_s2 + np.where(since >= 0, offset, 0.0))
