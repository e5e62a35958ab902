"""Sampled pulses brought into a frame of their own, where pulses of any duration and sampling rate compare."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: Places of the frame, in widths at half the peak from the middle of that width.
PLACES = np.linspace(-1.6, 3.4, 501)
_STEP = float(PLACES[1] - PLACES[0])
#: The frame is smoothed by a Gauss window of this deviation, in the same widths: less noise, whatever the rate.
_SMOOTH = 0.03
#: Points to a width at half the peak: samples are refined by a spline up to it, and averaged down to it.
_POINTS, _MOST = 150, 96


@dataclass(frozen=True, eq=False)
class Framed:
    """n pulses in their frames: `force_n` (n, p) at `middle_s + width_s * PLACES` on their own clocks."""

    force_n: Floats
    middle_s: Floats  # (n,): midway between the two instants of half the peak, from the first sample on
    width_s: Floats  # (n,): between these


def framed(force_n: Floats, step_s: float, width_s: float | None = None) -> Framed:
    """Pulses (n, m) in steps of `step_s`, of similar width; beyond their ends there is no force.

    The pulse is what surrounds the greatest force: of several contacts the strongest. Rows without any force above 0
    are NaN. Expects the zero line to be removed. `width_s`, some width at half the peak that tells how finely to look,
    is the narrowest pulse's unless given.
    """
    if width_s is None:
        width_s = max(int((force_n > 0.5 * force_n.max(axis=1, keepdims=True)).sum(axis=1).min()), 1) * step_s
    force, step, start = _averaged(force_n, step_s, width_s)
    fine, step = _refined(force, step, width_s)
    with np.errstate(invalid="ignore", divide="ignore"):
        first, last = level_crossings(fine, 0.5)
        middle, width = (first + last) / 2, last - first
        place = middle[:, None] + width[:, None] * PLACES
        values = _smoothed(_at(fine, place))
    values[~(fine.max(axis=1) > 0)] = np.nan
    return Framed(values, start + middle * step, width * step)


def level_crossings(force_n: Floats, level: float) -> tuple[Floats, Floats]:
    """Steps (n,): where pulses (n, m) last rise above `level` of their peak before it, and fall below behind it.

    The ends of the series where they do not.
    """
    from .kernel import crossings

    force = np.ascontiguousarray(force_n)
    found = np.empty((2, len(force)))
    crossings(force, np.argmax(force, axis=1), level, found)
    return found[0], found[1]


def _averaged(force: Floats, step: float, width_s: float) -> tuple[Floats, float, float]:
    """Neighbours averaged where a pulse has many more samples than its frame can use; the time of the first."""
    count = int(width_s / step / _MOST)
    if count < 2:
        return force, step, 0.0
    kept = force.shape[1] // count * count
    return force[:, :kept].reshape(len(force), -1, count).mean(axis=2), step * count, (count - 1) / 2 * step


def _refined(force: Floats, step: float, width_s: float) -> tuple[Floats, float]:
    """By a spline of the fifth degree through the samples, with nothing before and after them."""
    from scipy.interpolate import make_interp_spline

    finer = int(np.ceil(_POINTS * step / width_s))
    if finer == 1:
        return force, step
    index = np.arange(force.shape[1])
    spline = make_interp_spline(index, force, k=min(5, force.shape[1] - 1), axis=1)
    return np.asarray(spline(np.arange((len(index) - 1) * finer + 1) / finer)), step / finer


def _at(fine: Floats, place: Floats) -> Floats:
    """Straight between the points, 0 outside of them."""
    last = fine.shape[1] - 1
    inside = (place >= 0) & (place <= last)
    place = np.where(inside, place, 0.0)
    left = np.minimum(place.astype(np.intp), last - 1)
    rows = np.arange(len(fine))[:, None]
    values = fine[rows, left] + (place - left) * (fine[rows, left + 1] - fine[rows, left])
    return np.where(inside, values, 0.0)


def _smoothed(values: Floats) -> Floats:
    reach = int(np.ceil(4 * _SMOOTH / _STEP))
    window = np.exp(-0.5 * (np.arange(-reach, reach + 1) * _STEP / _SMOOTH) ** 2)
    window /= window.sum()
    padded = np.pad(values, ((0, 0), (reach, reach)))
    return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, len(window), axis=1) @ window)
