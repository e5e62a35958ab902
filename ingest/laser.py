"""The bullet's velocity at the muzzle, from the laser that it interrupts (thesis, sections 2.2.1 and 5.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..array_types import Floats
from .segmentation import rest_level

#: A passage is deeper than this many standard deviations of the noise at rest, and than this share of the deepest one.
_NOISE_MARGIN, _DEPTH_SHARE = 8.0, 1 / 3
#: Shorter interruptions are spikes: 85 mm at 80 m/s is 26 samples at 25 kHz.
_SHORTEST_PASSAGE = 5


class NoPassageError(ValueError):
    """The laser saw no whole passage; the message says what it saw instead."""


@dataclass(frozen=True)
class MuzzleVelocity:
    """A bullet's passage; the edges in (fractional) samples, the levels in the signal's own unit."""

    velocity_m_s: float
    velocity_u_m_s: float
    transit_time_s: float
    enter_sample: float
    leave_sample: float
    rest_level: float
    blocked_level: float


def muzzle_velocity(
    signal: NDArray[Any], sampling_rate_hz: float, length_m: float, *, length_u_m: float = 1e-3
) -> MuzzleVelocity:
    """Bullet length over the time that it stays in the beam, first passage only (a rebound may bring it back).

    `signal` (n,) in volts or metres, of either polarity; its first fiftieth (32 samples at least) shows the beam free.
    The edges are where it crosses half the depth of the passage, between samples; uncertainty by eq. 5.2. Raises
    `NoPassageError` where nothing crosses, or the bullet is in the beam at the record's end; `ValueError` for NaN.
    """
    values = np.asarray(signal, dtype=np.float64)
    if not np.all(np.isfinite(values)):
        raise ValueError(f"laser signal: sample {int(np.argmin(np.isfinite(values)))} is not finite")
    rest = rest_level(values[: max(32, values.size // 50)])
    enter, leave, depth = _first_passage(values - rest.baseline, rest.noise)
    transit = (leave - enter) / sampling_rate_hz
    spread = muzzle_velocity_uncertainty(length_m, transit, length_u_m, time_u_s=1 / sampling_rate_hz)
    blocked = rest.baseline + depth
    return MuzzleVelocity(length_m / transit, float(spread), transit, enter, leave, rest.baseline, blocked)


def muzzle_velocity_uncertainty(
    length_m: ArrayLike, transit_time_s: ArrayLike, length_u_m: ArrayLike = 1e-3, *, time_u_s: ArrayLike
) -> Floats:
    """Standard uncertainty (m/s) of length over time, broadcasting: eq. 5.2, whose time uncertainty is 1/fs."""
    length, time = np.asarray(length_m, dtype=np.float64), np.asarray(transit_time_s, dtype=np.float64)
    spread = np.hypot(np.asarray(length_u_m) / time, length * np.asarray(time_u_s) / time**2)
    return np.asarray(spread, dtype=np.float64)


def _first_passage(departure: Floats, noise: float) -> tuple[float, float, float]:
    """Edges (samples) and depth (signed) of the first long excursion of `departure` (n,) from rest."""
    from scipy.ndimage import median_filter

    smooth = median_filter(departure, size=_SHORTEST_PASSAGE) if departure.size else departure
    extreme = float(smooth[np.argmax(np.abs(smooth))]) if departure.size else 0.0
    if not abs(extreme) > _NOISE_MARGIN * noise:
        raise NoPassageError(
            f"no passage: the laser departs from rest by {abs(extreme):.3g} at most, and its noise is {noise:.3g}; "
            f"a bullet is expected to exceed {_NOISE_MARGIN:g} times the noise"
        )
    sign = np.sign(extreme)
    start, stop = _first_long_run(sign * smooth > _DEPTH_SHARE * abs(extreme))
    depth = float(np.median(sign * departure[start:stop]))
    share, smooth = sign * departure / depth, sign * smooth / depth
    enter = _crossing(share, smooth, start)
    leave = share.size - 1 - _crossing(share[::-1], smooth[::-1], share.size - stop)
    return enter, leave, float(sign * depth)


def _first_long_run(blocked: NDArray[np.bool_]) -> tuple[int, int]:
    steps = np.diff(blocked.astype(np.int8), prepend=0)
    starts, stops = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)
    for start, stop in zip(starts, stops, strict=False):  # the last run may not stop
        if stop - start >= _SHORTEST_PASSAGE:
            return int(start), int(stop)
    seen = f"the beam is blocked at sample {starts[-1]} and not freed by the record's end, sample {blocked.size - 1}"
    raise NoPassageError(f"no whole passage: {seen}" if starts.size > stops.size else "no passage: only short spikes")


def _crossing(share: Floats, smooth: Floats, inside: int) -> float:
    """Where `share` (1 = blocked) last crosses one half before the blocked sample `inside`, in fractional samples.

    The mean of all crossings between the smoothed signal's quarter points: noise on a slow edge makes several.
    """
    free = np.flatnonzero(smooth[:inside] < 0.25)
    if not free.size:
        raise NoPassageError("no whole passage: the beam is never free on one side of it")
    low = int(free[-1])
    high = low + int(np.argmax(smooth[low:] > 0.75))
    first = max(0, low - 1)
    stretch = share[first : high + 2] - 0.5
    at = np.flatnonzero((stretch[:-1] < 0) != (stretch[1:] < 0))
    return float(first + np.mean(at + stretch[at] / (stretch[at] - stretch[at + 1])))
