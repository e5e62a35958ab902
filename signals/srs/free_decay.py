"""An oscillator left to itself: its largest responses from now on, exact and without a series."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats


def extremes(start: Floats, slope: Floats, damping_ratio: float) -> tuple[Floats, Floats]:
    """Largest and least of exp(-zeta tau) (A cos(delta tau) + B sin(delta tau)) over tau >= 0, arrays of one shape.

    `start` is the value at 0, `slope` the derivative there; time tau is counted in radians of the undamped oscillator.
    With A = R cos(phi), B = R sin(phi) and psi = delta tau - phi the turning points are psi = m pi - asin(zeta): the
    first two of them and the start hold both extremes, as every later one is smaller.
    """
    delta, lag = np.sqrt(1 - damping_ratio**2), np.arcsin(damping_ratio)
    sine = (slope + damping_ratio * start) / delta
    radius, phi = np.hypot(start, sine), np.arctan2(sine, start)
    m = np.ceil((lag - phi) / np.pi)
    tau = np.maximum(m * np.pi - lag + phi, 0.0) / delta
    first = radius * np.exp(-damping_ratio * tau) * delta * np.where(m % 2 == 0, 1.0, -1.0)
    second = -first * np.exp(-damping_ratio * np.pi / delta)
    largest = np.maximum(start, np.maximum(first, second))
    least = np.minimum(start, np.minimum(first, second))
    return np.asarray(largest), np.asarray(least)
