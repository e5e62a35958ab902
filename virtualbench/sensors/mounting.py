"""An accelerometer on its mounting: a mass on a spring that the structure shakes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .build import SensorBuild


def resonance_hz(sensor: SensorBuild, effects: Mapping[str, float]) -> float | None:
    """Where a sensor's mounting resonates: its own resonance over the effect's strength; None for a rigid one."""
    strength = effects["sensor.mount_resonance"]
    if sensor.quantity != "acceleration" or sensor.mount_resonance_hz is None or not strength:
        return None
    return sensor.mount_resonance_hz / strength


def transmissibility(
    roots: NDArray[np.complex128], sensor: SensorBuild, effects: Mapping[str, float]
) -> NDArray[np.complex128]:
    """What the sensor feels of accelerations exp(s t) of its base, by complex frequency s (m,) in 1/s."""
    resonance = resonance_hz(sensor, effects)
    if resonance is None:
        return np.ones_like(roots)
    omega = 2 * np.pi * resonance
    follows = 2 * sensor.mount_damping * omega * roots + omega**2
    return np.asarray(follows / (roots**2 + follows))


def mounted(acceleration: Floats, period_s: float, resonance_hz: float, damping: float) -> Floats:
    """What the sensor feels (n,), same unit: (2 z w s + w^2) / (s^2 + 2 z w s + w^2), the transmissibility of a base.

    Exact for an acceleration that is linear between samples (first-order hold, the ramp invariance of Smallwood 1981),
    from rest at the first value. A resonance beyond 0.4 of the grid's rate is taken for a rigid mounting.
    """
    if resonance_hz * period_s > 0.4:
        return acceleration
    from scipy.signal import cont2discrete, lfilter, lfilter_zi

    omega = 2 * np.pi * resonance_hz
    top = np.array([2 * damping * omega, omega**2])
    bottom = np.array([1.0, 2 * damping * omega, omega**2])
    b, a, _ = cont2discrete((top, bottom), period_s, method="foh")
    b = np.atleast_1d(np.squeeze(b))
    felt, _ = lfilter(b, a, acceleration, zi=lfilter_zi(b, a) * acceleration[0])
    return np.asarray(felt, dtype=np.float64)
