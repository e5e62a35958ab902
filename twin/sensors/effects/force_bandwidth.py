"""The force channel is low-pass filtered."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...effects import Floats, Value, parameter
from ..effect import SensorEffect
from ..filters import filtered


@dataclass(frozen=True)
class ForceBandwidth(SensorEffect):
    """One pole, as of a charge amplifier's input; exact for a force that is linear between samples.

    The cut-off (-3 dB) is 1 / (2 pi time_constant_s). The impulse is kept.
    """

    id = "sensor.force_bandwidth"
    law = "tau F_reading' + F_reading = F"
    source = "Doebelin, Measurement Systems, 5th ed. 2003, ch. 3.3 (first-order instrument)"
    place = 3

    time_constant_s: Value = parameter("of the low pass", "s", default=1.6e-5, low=0.0, high=1e-2, off=0.0)

    def measured_force_n(self, force_n: Floats, dt_s: float) -> Floats:
        if not np.any(self.time_constant_s):
            return force_n
        return filtered(force_n, lambda tau: _one_pole(tau, dt_s), self.time_constant_s)


def _one_pole(time_constant_s: float, dt_s: float) -> tuple[Floats, Floats]:
    """Ramp-invariant: y' = (x - y) / tau solved for x linear over a step."""
    if time_constant_s == 0:
        return np.ones(1), np.ones(1)
    r = dt_s / time_constant_s
    decay, mean = np.exp(-r), -np.expm1(-r) / r
    if r < 1e-4:  # the differences below lose their digits
        new, old = r / 2 - r**2 / 6, r / 2 - r**2 / 3
    else:
        new, old = 1 - mean, mean - decay
    return np.array([new, old]), np.array([1.0, -decay])
