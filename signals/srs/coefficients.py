"""Coefficients of one oscillator for one time step, exact where the base acceleration is linear in
between.

theta = omega dt, zeta = 1 / 2Q, a the base acceleration, z the displacement relative to the base.
With the states p = -omega^2 z and v = -omega z', and time counted in radians, the oscillator is p'
= v, v' = a - p - 2 zeta v, and its absolute acceleration is p + 2 zeta v. S is the response v to a
step of 1, G that of p to the same step, H that of p to a ramp that ends at 1 after one time step:

    S = exp(-zeta theta) sin(delta theta) / delta,    delta = sqrt(1 - zeta^2)
    G = integral of S = 1 - exp(-zeta theta) cos(delta theta) - zeta S
    H = integral of G / theta = 1 - (S + 2 zeta G) / theta

For small theta G and H are the small rests of large numbers; the series keeps their digits.

An oscillator left to itself: its largest responses from now on, exact and without a series.

The filters of ISO 18431-4 (thesis, eq. 1.3 to 1.8) are another form of the same recursion, which
loses digits where omega dt is small. Errors found: eq. 1.4 has T for the time step, where 1.5 to
1.8 have Delta t, and 1.7 and 1.8 have a for the alpha of 1.3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...array_types import Floats

#: Below, the series; its next term is under 1e-19 of the first. Above, the closed form loses a
#: digit at most.
_SERIES_BELOW, _TERMS = 1.0, 20
#: Coefficients of so many lines are no more than a spectrum of a short record costs.
_KEPT_LINES = 64
_FACTORIALS = np.array([float(math.factorial(k)) for k in range(_TERMS + 3)])


@dataclass(frozen=True, eq=False)
class Steps:
    """S, G, H of oscillators (f,); `theta` is omega dt."""

    theta: Floats
    damping_ratio: float
    s: Floats
    g: Floats
    h: Floats


def steps(theta: Floats, damping_ratio: float) -> Steps:
    """`theta` (f,) above 0, `damping_ratio` from 0 to below 1. Those of a few lines are kept for
    the next record."""
    if theta.size <= _KEPT_LINES:
        return _kept_steps(theta.astype(np.float64).tobytes(), damping_ratio)
    return _steps(theta, damping_ratio)


@lru_cache(maxsize=64)
def _kept_steps(theta: bytes, damping_ratio: float) -> Steps:
    return _steps(np.frombuffer(theta), damping_ratio)


def _steps(theta: Floats, damping_ratio: float) -> Steps:
    small, values = theta < _SERIES_BELOW, np.empty((3, theta.size))
    for of, form in ((small, _series), (~small, _closed)):
        values[:, of] = form(theta[of], damping_ratio)
    return Steps(theta, damping_ratio, *values)


def _closed(theta: Floats, zeta: float) -> Floats:
    delta = np.sqrt(1 - zeta**2)
    decay = np.exp(-zeta * theta)
    s = decay * np.sin(delta * theta) / delta
    g = 1 - decay * np.cos(delta * theta) - zeta * s
    return np.stack([s, g, 1 - (s + 2 * zeta * g) / theta])


def _series(theta: Floats, zeta: float) -> Floats:
    """S'' = -2 zeta S' - S gives the derivatives of S at 0; G and H are its series integrated term
    by term."""
    derivatives = [0.0, 1.0]
    for _ in range(_TERMS - 1):
        derivatives.append(-2 * zeta * derivatives[-1] - derivatives[-2])
    powers = np.vander(theta, _TERMS + 1, increasing=True)
    s, g, h = (powers @ (np.array(derivatives) / _FACTORIALS[i : i + _TERMS + 1]) for i in range(3))
    return np.stack([s, theta * g, theta * h])


def extremes(start: Floats, slope: Floats, damping_ratio: float) -> tuple[Floats, Floats]:
    """Largest and least of exp(-zeta tau) (A cos(delta tau) + B sin(delta tau)) over tau >= 0,
    arrays of one shape.

    `start` is the value at 0, `slope` the derivative there; time tau is counted in radians of the
    undamped oscillator. With A = R cos(phi), B = R sin(phi) and psi = delta tau - phi the turning
    points are psi = m pi - asin(zeta): the first two of them and the start hold both extremes, as
    every later one is smaller.
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
