"""Clipping: a flat stretch where a crest should be, or a peak at the sensor's full scale."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....signals.srs.record import Spectrum
from .base import Finding, Floats, Record

#: Two equal neighbours straddle the top of any symmetric pulse; three need a cut or a slow crest.
LIMIT = 3
#: Spread that a flat stretch may have, as a share of what a parabola through its surroundings would spread. A crest
#: rounded to a step has half of it or more.
MAX_SPREAD_SHARE = 0.25
#: From this share of the full scale on, a peak is only a bound.
RANGE_SHARE = 0.99
#: An extreme nearer to rest than this share of the largest deviation is no rail.
MIN_DEVIATION_SHARE = 0.2


def check_clipping(record: Record, _: Spectrum) -> Finding | None:
    """The longest flat top or bottom, in samples; with a known range, what comes near it, in shares of it."""
    if record.range_m_s2 is not None and record.range_m_s2 > 0:
        value = float(np.abs(record.acceleration).max()) / record.range_m_s2
        if value >= RANGE_SHARE:
            message = (
                f"reaches {value:.1%} of the sensor's {record.range_m_s2:.4g} m/s2: every line is only a lower bound; "
                "measure again with a larger range"
            )
            return Finding("clipping", value, RANGE_SHARE, "", message)
    longest, level = max((_flat(record, side) for side in (1.0, -1.0)), key=lambda found: found[0])
    if longest < LIMIT:
        return None
    message = (
        f"stays at {level:.5g} m/s2 for {longest} samples, where a crest should be: every line is only a lower bound; "
        "measure again with a larger range"
    )
    return Finding("clipping", longest, LIMIT, "samples", message)


def _flat(record: Record, side: float) -> tuple[int, float]:
    """Samples of the longest cut stretch at one extreme (0 for none), and its level."""
    x = side * (record.acceleration - record.rest_m_s2)
    top = float(x.max())
    if top < MIN_DEVIATION_SHARE * record.peak_m_s2 or top == 0.0:
        return 0, 0.0
    step = _step(x)
    cut = (ends for ends in _stretches(x >= top - 1.01 * step) if _cut(x, *ends, step))
    longest = max((last - first + 1 for first, last in cut), default=0)
    return longest, record.rest_m_s2 + side * top


def _cut(x: Floats, first: int, last: int, step: float) -> bool:
    """Whether x[first..last] is flatter than a crest can be.

    A crest is a parabola: L samples of it, watched m further out on either side, have fallen within themselves by
    ((L - 1) / (L - 1 + 2 m))^2 of the drop seen out there. A step of the converter counts as spread. Stretches at an
    end of the record, and those shorter than three samples, are none.
    """
    length = last - first + 1
    if length < LIMIT or first == 0 or last == x.size - 1:
        return False
    beside = max(2, -(-length // 4))
    drop = x[first : last + 1].max() - max(x[max(first - beside, 0)], x[min(last + beside, x.size - 1)])
    share = ((length - 1) / (length - 1 + 2 * beside)) ** 2
    spread = max(float(np.ptp(x[first : last + 1])), step)
    return bool(spread < MAX_SPREAD_SHARE * share * drop)


def _stretches(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of every run of true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    return [(int(first), int(end) - 1) for first, end in edges.reshape(-1, 2)]


def _step(x: Floats) -> float:
    """The smallest difference between values near the top: the converter's step, or an upper bound of it.

    Rounding of a float32 is no step; neither is that of a unit's conversion.
    """
    near = np.sort(x)[-4096:]
    gaps = np.diff(near)
    gaps = gaps[gaps > 1e-6 * float(np.abs(near).max())]
    return float(gaps.min()) if gaps.size else 0.0
