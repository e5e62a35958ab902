"""The tank's pressure just before the shot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .segmentation import rest_level

#: The drop is found in medians over this many samples, and exceeds this many deviations of their noise.
_BLOCK, _NOISE_MARGIN = 16, 8.0
#: Type A uncertainty by means over this many pieces: hum and drift make neighbouring samples alike.
_PIECES = 8
_SMALLEST_STRETCH = 2 * _PIECES


class NoDropError(ValueError):
    """The pressure record shows no shot, or too little before it; the message says what was seen."""


@dataclass(frozen=True)
class TankPressure:
    """Mean pressure over samples `first:stop`, with the standard uncertainty of that mean (type A only)."""

    pressure_pa: float
    pressure_u_pa: float
    first: int
    stop: int


def tank_pressure_before(
    pressure_pa: NDArray[Any], *, longest_stretch: int = 10_000, guard: int = _BLOCK
) -> TankPressure:
    """Mean of `pressure_pa` (n,) over at most `longest_stretch` samples that end `guard` before the drop.

    Values beyond six robust deviations are left out of the mean. Raises `NoDropError` where pressure does not fall, or
    falls within the first samples; `ValueError` for a sample that is not finite.
    """
    values = np.asarray(pressure_pa, dtype=np.float64)
    if not np.all(np.isfinite(values)):
        raise ValueError(f"pressure: sample {int(np.argmin(np.isfinite(values)))} is not finite")
    stop = _drop(values) - guard
    first = max(0, stop - longest_stretch)
    if stop - first < _SMALLEST_STRETCH:
        raise NoDropError(f"{max(0, stop - first)} samples before the drop: expected at least {_SMALLEST_STRETCH}")
    stretch = values[first:stop]
    rest = rest_level(stretch)
    kept = np.where(np.abs(stretch - rest.baseline) <= 6 * rest.noise, stretch, np.nan) if rest.noise else stretch
    pieces = [piece[np.isfinite(piece)] for piece in np.array_split(kept, _PIECES)]
    means = np.array([piece.mean() for piece in pieces if piece.size])  # a valve's slow start may take a whole one
    return TankPressure(float(np.nanmean(kept)), float(means.std(ddof=1) / np.sqrt(means.size)), first, stop)


def _drop(values: NDArray[np.float64]) -> int:
    """The sample at which the pressure leaves its level.

    The knee of the curve is where it lies highest above the chord from its beginning to half its fall: a level that
    leaks before the shot has the same knee, where a threshold would be crossed by the leak. A valve that opens
    slowly rounds the knee off, hence the step back by a quarter of what is left to half the fall.
    """
    blocks = np.median(values[: values.size // _BLOCK * _BLOCK].reshape(-1, _BLOCK), axis=1)
    if blocks.size < 4:
        raise NoDropError(f"{values.size} samples of pressure: expected at least {4 * _BLOCK}")
    noise = rest_level(np.diff(values)).noise / np.sqrt(_BLOCK)
    level = float(np.median(blocks[: max(3, blocks.size // 20)]))
    fall = level - float(blocks.min())
    half = int(np.argmax(blocks <= level - fall / 2))
    above = blocks[: half + 1] - np.linspace(blocks[0], blocks[half], half + 1)
    knee = int(np.argmax(above))
    if not above[knee] > _NOISE_MARGIN * noise:
        raise NoDropError(
            f"no drop: pressure falls by {fall:.3g} Pa, by {above[knee]:.3g} Pa at once, with noise of {noise:.3g} Pa; "
            f"a shot is expected to exceed {_NOISE_MARGIN:g} times the noise, after {_SMALLEST_STRETCH} samples of rest"
        )
    return (knee - (half - knee) // 4) * _BLOCK
