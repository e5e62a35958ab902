"""The force channel is low-pass filtered."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ....array_types import Floats
from ...effects import Value, parameter
from ..effect import SensorEffect, filtered


@dataclass(frozen=True)
class ForceBandwidth(SensorEffect):
    """One pole, as of a charge amplifier's input, or Butterworth's two, as of its filter.

    Exact for a force that is linear between samples. The cut-off (-3 dB) is 1 / (2 pi
    time_constant_s), or 1 / corner_period_s. The impulse is kept.
    """

    id = "sensor.force_bandwidth"
    law = (
        "tau F_reading' + F_reading = F, or F_reading'' / w^2 + sqrt(2) "
        "F_reading' / w + F_reading = F, w = 2 pi / T"
    )
    source = "Doebelin, Measurement Systems, 5th ed. 2003, ch. 3.3 (first-order instrument)"
    place = 3

    # down to 1 kHz, the lowest filter of charge amplifiers that one may forget at an impact
    time_constant_s: Value = parameter(
        "of the low pass",
        "s",
        default=1.6e-5,
        low=0.0,
        high=1e-2,
        off=0.0,
        likely=(0.0, 1.6e-4),
        owner="channel",
    )

    # as the other: down to 1 kHz
    corner_period_s: Value = parameter(
        "T of a low pass of two poles",
        "s",
        default=0.0,
        low=0.0,
        high=1e-1,
        off=0.0,
        likely=(0.0, 1e-3),
        owner="channel",
    )
    regimes: ClassVar[tuple[tuple[str, ...], ...]] = (("time_constant_s",), ("corner_period_s",))

    def measured_force_n(self, force_n: Floats, dt_s: float) -> Floats:
        if np.any(self.time_constant_s):
            force_n = filtered(force_n, lambda tau: _one_pole(tau, dt_s), self.time_constant_s)
        if np.any(self.corner_period_s):
            force_n = filtered(
                force_n, lambda period: _two_poles(period, dt_s), self.corner_period_s
            )
        return force_n

    def true_force_n(self, reading_n: Floats, dt_s: float) -> Floats:
        """Both differential equations of the low passes, read from right to left."""
        seconds = float(np.asarray(self.corner_period_s)) / (2 * np.pi)
        if seconds > 0:
            rate = _rate(reading_n, dt_s)
            reading_n = reading_n + np.sqrt(2) * seconds * rate + seconds**2 * _rate(rate, dt_s)
        return np.asarray(reading_n + self.time_constant_s * _rate(reading_n, dt_s))


def _rate(values: Floats, dt_s: float) -> Floats:
    """Change per second, by differences of sixth order: a force has content up to a tenth of its
    sampling rate."""
    from scipy.signal import savgol_filter

    return np.asarray(savgol_filter(values, 7, 6, deriv=1, delta=dt_s, mode="nearest"))


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


def _two_poles(period_s: float, dt_s: float) -> tuple[Floats, Floats]:
    """Ramp-invariant too: Butterworth's w^2 / (p^2 + sqrt(2) w p + w^2), its poles at (-1 +- i) w /
    sqrt(2)."""
    if period_s == 0:
        return np.ones(1), np.ones(1)
    x = math.sqrt(2) * math.pi * dt_s / period_s
    decay = math.exp(-x)
    bottom = np.array([1.0, -2 * decay * math.cos(x), decay**2])
    ramp = [0.0, 0.0, *(_ramp_response(x, steps) for steps in (1, 2, 3))]
    return np.convolve(np.diff(ramp, 2), bottom)[:3], bottom


#: Of Re exp((i - 1) y) - 1 + y, in powers of y up to 1: power and factor.
_SERIES = tuple((n, ((1j - 1) ** n).real / math.factorial(n)) for n in range(3, 24))


def _ramp_response(x: float, steps: int) -> float:
    """After so many steps, of a ramp that rises by 1 in each: k - (1 - exp(-k x) cos(k x)) / x."""
    y = steps * x
    if y > 1:
        return steps - (1 - math.exp(-y) * math.cos(y)) / x
    # Re exp((i - 1) y) as a series: the difference above loses its digits.
    return math.fsum(factor * y**n for n, factor in _SERIES) / x
