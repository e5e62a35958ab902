"""What a spectrum is asked of, refused where it makes no sense."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...array_types import Floats

DEFAULT_Q = 10.0


def checked_records(acceleration: Floats) -> Floats:
    """Records (..., n) as contiguous numbers.

    Raises `ValueError` for none, for what is no number, and for a constant other than 0: a shot that fails is all 0.
    """
    # One kind of array: the compiled loop knows no other.
    records = np.require(acceleration, np.float64, ["C", "A", "W"])
    if records.ndim == 0 or records.size == 0:
        raise ValueError(f"acceleration has shape {records.shape}: expected (n,) or (..., n) with samples in it")
    highest, lowest = records.max(axis=-1), records.min(axis=-1)  # NaN where a sample is NaN
    if not (np.isfinite(highest) & np.isfinite(lowest)).all():
        bad = np.argwhere(~np.isfinite(records))
        raise ValueError(f"acceleration has {len(bad)} samples that are no numbers, the first at {bad[0, -1]}")
    stuck = (highest == lowest) & (highest != 0)
    if records.shape[-1] > 1 and np.any(stuck):
        raise ValueError(f"acceleration is constant at {highest[stuck].flat[0]:g} m/s2: is the channel connected?")
    return records


def checked_rate(sampling_rate_hz: float) -> float:
    """Raises `ValueError`."""
    if not (math.isfinite(sampling_rate_hz) and sampling_rate_hz > 0):
        raise ValueError(f"sampling_rate_hz = {sampling_rate_hz!r}: expected a positive number")
    return float(sampling_rate_hz)


def checked_damping(q: float | None, damping_ratio: float | None) -> float:
    """The damping ratio of the oscillators, Q = 10 by default. Raises `ValueError` for both, or none below critical."""
    if q is not None and damping_ratio is not None:
        raise ValueError(f"q = {q!r} and damping_ratio = {damping_ratio!r}: expected one of them")
    if damping_ratio is not None:
        if not 0 < damping_ratio < 1:
            raise ValueError(f"damping_ratio = {damping_ratio!r}: expected above 0 and below 1")
        return float(damping_ratio)
    quality = DEFAULT_Q if q is None else q
    if not 0.5 < quality < math.inf:
        raise ValueError(f"q = {quality!r}: expected above 0.5, finite")
    return 1 / (2 * quality)


def checked_lines(frequency_hz: Floats | Sequence[float], sampling_rate_hz: float) -> Floats:
    """Lines (f,) in any order. Raises `ValueError` for none, and at half the sampling rate and above."""
    lines = np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
    if lines.ndim != 1 or lines.size == 0 or not np.all(lines > 0):
        raise ValueError("frequency_hz: expected (f,) positive numbers, at least one")
    if not lines.max() < sampling_rate_hz / 2:
        raise ValueError(
            f"frequency_hz up to {lines.max():g}: expected below {sampling_rate_hz / 2:g}, half the sampling rate; "
            "ask for lines below, or record faster: nothing above is in the record"
        )
    return lines
