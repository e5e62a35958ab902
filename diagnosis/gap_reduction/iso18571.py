"""The rating of a simulated against a measured record after ISO/TS 18571:2014, from 0 to 1.

Written from the specification's formulas. `objective-rating-metrics` (TU Graz) is a peer for the tests and no
dependency: it brings seaborn, shapely and others along.
"""

from __future__ import annotations

import numpy as np

from ..localisation.means import Floats
from .time_warping import warped

#: Inner and outer corridor as parts of the largest measured value; the largest shift and the warping's window as parts
#: of the record; the errors of magnitude and slope at which their scores are 0.
_INNER, _OUTER, _SHIFT, _WINDOW, _MAGNITUDE, _SLOPE = 0.05, 0.50, 0.20, 0.10, 0.50, 2.0
#: Of corridor, phase, magnitude and slope.
_WEIGHTS = np.array([0.4, 0.2, 0.2, 0.2])
_SMOOTH = 9
_CONSTANT = 1e-12


def rating(measured: Floats, simulated: Floats) -> float:
    """Of two records (n,) at the same even steps. Raises `ValueError` for different lengths or a constant record."""
    if measured.shape != simulated.shape or len(measured) <= 2 * _SMOOTH:
        raise ValueError(f"records of {len(measured)} and {len(simulated)} samples: give two of one length, above 18")
    if not (np.ptp(measured) > 0 and np.ptp(simulated) > 0):
        raise ValueError("a constant record cannot be rated: nothing was measured, or nothing simulated")
    shift = _best_shift(measured, simulated)
    x, y = _shifted(measured, simulated, shift)
    scores = [_corridor(measured, simulated), _phase(shift, len(measured)), _magnitude(x, y), _slope(x, y)]
    return float(_WEIGHTS @ scores)


def _corridor(measured: Floats, simulated: Floats) -> float:
    top = np.abs(measured).max()
    ratio = (_OUTER * top - np.abs(simulated - measured)) / ((_OUTER - _INNER) * top)
    return float(np.mean(np.clip(ratio, 0.0, 1.0) ** 2))


def _best_shift(measured: Floats, simulated: Floats) -> int:
    """In samples, above 0 where the simulation comes late: where both correlate best; the smallest of equals."""
    most = int(np.floor(len(measured) * _SHIFT))
    shifts = [0, *(sign * n for n in range(1, most + 1) for sign in (1, -1))]
    late, early = _correlations(measured, simulated, most), _correlations(simulated, measured, most)
    return shifts[int(np.argmax([late[n] if n >= 0 else early[-n] for n in shifts]))]


def _correlations(first: Floats, late: Floats, most: int) -> Floats:
    """(most + 1,): correlation of the first n - k samples of one with the last n - k of the other.

    Minus infinity where either of these is constant: a force that rests for part of its record has no phase there.
    """
    x, y = first - first.mean(), late - late.mean()
    left = len(x) - np.arange(most + 1)
    sums = [np.cumsum(each)[left - 1] for each in (x, y[::-1], x**2, y[::-1] ** 2)]
    product = np.correlate(y, x, "full")[len(x) - 1 : len(x) + most]
    covariance = product - sums[0] * sums[1] / left
    squares = np.array([sums[2] - sums[0] ** 2 / left, sums[3] - sums[1] ** 2 / left])
    # What cancellation leaves of a constant stretch is below this share of the whole record's square.
    constant = (squares <= _CONSTANT * squares[:, :1]).any(axis=0)
    size = np.sqrt(np.prod(np.where(constant, 1.0, squares), axis=0))
    return np.where(constant, -np.inf, covariance / size)


def _shifted(measured: Floats, simulated: Floats, shift: int) -> tuple[Floats, Floats]:
    if shift >= 0:
        return measured[: len(measured) - shift], simulated[shift:]
    return measured[-shift:], simulated[:shift]


def _phase(shift: int, samples: int) -> float:
    return max(0.0, 1.0 - abs(shift) / (_SHIFT * samples))


def _magnitude(measured: Floats, simulated: Floats) -> float:
    """Of the records after dynamic time warping, which takes local differences in phase away."""
    path = warped(simulated, measured, int(np.ceil(_WINDOW * len(measured))) - 1)
    error = np.abs(simulated[path[:, 0]] - measured[path[:, 1]]).sum()
    return _score(error, np.abs(measured[path[:, 1]]).sum(), _MAGNITUDE)


def _slope(measured: Floats, simulated: Floats) -> float:
    x, y = _smooth_slope(measured), _smooth_slope(simulated)
    return _score(np.abs(y - x).sum(), np.abs(x).sum(), _SLOPE)


def _score(error: float, size: float, most: float) -> float:
    """1 without an error, 0 from `most` of the size on; 0 for an error of what is nothing."""
    return 0.0 if error > most * size else float(1.0 - error / (most * size)) if size > 0 else 1.0


def _smooth_slope(values: Floats) -> Floats:
    """Central differences averaged over nine samples; over the first or last 1, 3, 5, 7 at the ends."""
    slope, half = np.gradient(values), _SMOOTH // 2
    smooth = np.convolve(slope, np.ones(_SMOOTH) / _SMOOTH, mode="same")
    for i in range(half):
        smooth[i], smooth[-1 - i] = slope[: 2 * i + 1].mean(), slope[-2 * i - 1 :].mean()
    return np.asarray(smooth)
