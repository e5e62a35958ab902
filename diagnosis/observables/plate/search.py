"""Which modes ring in records, without a guess: the loudest line of what is left, one after the other.

The order of RELAX (Li and Stoica, IEEE Trans. Signal Process. 44, 1996, 281) with damped lines: find one, refine all,
go on.
"""

from __future__ import annotations

import numpy as np

from ...record import Floats
from .poles import Basis, Poles, orthonormal, refined, waves

#: The search ends at a line that is less than this times the quiet tenth of the band, or so much below the loudest.
_OVER_NOISE, _RANGE = 8.0, 3e-3
#: Refining steps after each line, and at the end.
_STEPS, _LAST_STEPS = 2, 8
_PADDING = 2
#: Dampings that a new line is tried with, over the guess; no line is damped more than the last.
_WIDTHS, _MOST_DAMPED = (0.3, 1.0, 2.0, 4.0, 8.0), 0.3


def found_poles(records: Floats, step_s: float, band_hz: tuple[float, float], damping_ratio: float, most: int) -> Poles:
    """Poles within a band, at most so many, of records (n, k), in rising order; `damping_ratio` is a first guess."""
    poles = Poles(np.zeros(0), np.zeros(0))
    left = _without_offset(records)
    loudest = 0.0
    for _ in range(most):
        frequency, level, quiet = _loudest(left, step_s, band_hz)
        loudest = max(loudest, level)
        if level < _OVER_NOISE * quiet or level < _RANGE * loudest:
            break
        new = _widest(left, step_s, frequency, damping_ratio)
        poles = Poles(np.append(poles.decay, new.decay), np.append(poles.omega, new.omega))
        poles = _inside(refined(poles, records, step_s, _STEPS), band_hz)
        if not poles.omega.size:
            break
        left = Basis.of(poles, records.shape[0], step_s).left(records)
    return refined(poles, records, step_s, _LAST_STEPS).sorted() if poles.omega.size else poles


def _loudest(left: Floats, step_s: float, band_hz: tuple[float, float]) -> tuple[float, float, float]:
    """Frequency and amplitude of the loudest line in a band, and the amplitude of the band's quiet tenth."""
    from scipy.fft import next_fast_len, rfft

    n = left.shape[0]
    window = np.cos(0.5 * np.pi * np.arange(n) / n) ** 2  # ringing is loudest at its beginning
    length = next_fast_len(_PADDING * n, real=True)
    level = np.sqrt(np.mean(np.abs(rfft(left * window[:, None], length, axis=0)) ** 2, axis=1))
    frequency = np.arange(level.size) / (length * step_s)
    inside = np.flatnonzero((frequency >= band_hz[0]) & (frequency <= band_hz[1]))
    at = inside[int(np.argmax(level[inside]))]
    return float(frequency[at]), float(level[at]), float(np.quantile(level[inside], 0.1))


def _widest(left: Floats, step_s: float, frequency_hz: float, damping_ratio: float) -> Poles:
    """The line at a frequency whose damping, of some about a guess, takes most of what is left."""
    tried = [Poles.of(np.array([frequency_hz]), np.array([min(damping_ratio * by, _MOST_DAMPED)])) for by in _WIDTHS]
    taken = [float(np.sum((line_basis(each, left.shape[0], step_s).T @ left) ** 2)) for each in tried]
    return tried[int(np.argmax(taken))]


def line_basis(poles: Poles, samples: int, step_s: float) -> Floats:
    """Orthonormal columns (n, 2M) of what poles ring with."""
    return orthonormal(waves(poles, samples, step_s))[0]


def _inside(poles: Poles, band_hz: tuple[float, float]) -> Poles:
    """Without those that left the band, fell together, or no longer ring."""
    poles = poles.sorted()
    frequency = poles.frequency_hz
    apart = np.r_[True, np.diff(poles.omega) > 0.1 * poles.decay[1:]] if frequency.size else np.zeros(0, dtype=bool)
    good = (
        apart
        & (frequency >= 0.8 * band_hz[0])
        & (frequency <= 1.1 * band_hz[1])
        & (poles.damping_ratio <= _MOST_DAMPED)
    )
    return Poles(poles.decay[good], poles.omega[good])


def _without_offset(records: Floats) -> Floats:
    return np.asarray(records - records.mean(axis=0))
