"""Resonance of the accelerometer's mounting inside the band."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....array_types import Complexes, Floats
from ...effects import Value, parameter
from ..effect import SensorEffect, filtered


@dataclass(frozen=True)
class MountResonance(SensorEffect):
    """The sensor on a spring and damper feels its own absolute acceleration, not the plate's.

    Exact for an acceleration that is linear between samples. The natural frequency is 1 / period_s.
    """

    id = "sensor.mount_resonance"
    law = "x'' = 2 zeta w (y' - x') + w^2 (y - x), w = 2 pi / period; x'' is read for y''"
    source = (
        "ISO 5348:2021 (mechanical mounting of accelerometers); ISO "
        "18431-4:2007, eq. 6 (its recursion)"
    )
    place = 0

    # A stud holds to 30 kHz and more, glue, wax and magnets to 7 to 30 kHz (ISO 5348).
    period_s: Value = parameter(
        "of the mounted resonance",
        "s",
        default=5e-5,
        low=0.0,
        high=1e-2,
        off=0.0,
        likely=(0.0, 1.4e-4),
        owner="channel",
    )
    # How it acts, not whether. A stud on steel leaves the sensor's own 0.01 or so (Q of some 30 to
    # 50); wax, adhesive tape and soft glue damp by up to 0.2 (Harris, Shock and Vibration Handbook,
    # ch. on accelerometers; ISO 5348).
    damping_ratio: Value = parameter(
        "of the mounted resonance",
        "",
        default=0.03,
        low=1e-3,
        high=0.9,
        off=0.03,
        likely=(0.005, 0.2),
        owner="channel",
    )

    def measured_acceleration_m_s2(self, acceleration_m_s2: Floats, dt_s: float) -> Floats:
        if not np.any(self.period_s):
            return acceleration_m_s2
        return filtered(
            acceleration_m_s2,
            lambda p, z: _oscillator(p, z, dt_s),
            self.period_s,
            self.damping_ratio,
        )

    def measured_amplitude(self, amplitude: Complexes, poles: Complexes) -> Complexes:
        """The transmissibility of the mounting."""
        period = np.reshape(self.period_s, (-1, 1)) / (
            2 * np.pi
        )  # 0: a mounting that follows the plate
        follows = 2 * np.reshape(self.damping_ratio, (-1, 1)) * period * poles + 1
        return np.asarray(amplitude * follows / ((period * poles) ** 2 + follows))


def _oscillator(period_s: float, damping_ratio: float, dt_s: float) -> tuple[Floats, Floats]:
    """Ramp-invariant filter of the absolute acceleration (the thesis's eq. 1.4-1.8)."""
    if period_s == 0:
        return np.ones(1), np.ones(1)
    a = 2 * np.pi / period_s * dt_s * damping_ratio
    b = 2 * np.pi / period_s * dt_s * np.sqrt(1 - damping_ratio**2)
    decay, share = np.exp(-a), np.exp(-a) * np.sin(b) / b
    forward = np.array([1 - share, 2 * (share - decay * np.cos(b)), decay**2 - share])
    return forward, np.array([1.0, -2 * decay * np.cos(b), decay**2])
