"""Sampled pulses brought into a frame of their own, where pulses of any duration and sampling rate compare."""

from __future__ import annotations

import numpy as np

from ....array_types import Floats

#: Places of the frame, in widths at half the peak from the middle of that width.
PLACES = np.linspace(-1.6, 3.4, 501)
#: The frame is smoothed by a Gauss window of this deviation, in the same widths: less noise, whatever the rate.
_SMOOTH = 0.03
#: Points to a width at half the peak: samples are refined by a spline up to it, and averaged down to it.
_POINTS, _MOST = 150, 96


def framed(force_n: Floats, step_s: float, width_s: float | None = None) -> tuple[Floats, Floats]:
    """Pulses (n, m) in steps of `step_s`, of similar width, at `PLACES` (n, p), and their widths at half the peak (n,).

    Beyond their ends there is no force. The pulse is what surrounds the greatest force: of several contacts the
    strongest. Rows without any force above 0 are NaN. Expects the zero line to be removed. `width_s`, some width at
    half the peak that tells how finely to look, is the narrowest pulse's unless given.
    """
    from scipy.ndimage import gaussian_filter1d

    if width_s is None:
        width_s = max(int((force_n > 0.5 * force_n.max(axis=1, keepdims=True)).sum(axis=1).min()), 1) * step_s
    if (count := int(width_s / step_s / _MOST)) >= 2:  # many more samples than the frame can use
        whole = force_n.shape[1] // count * count
        force_n, step_s = force_n[:, :whole].reshape(len(force_n), -1, count).mean(axis=2), step_s * count
    fine, step_s = _refined(force_n, step_s, width_s)
    with np.errstate(invalid="ignore", divide="ignore"):
        first, last = level_crossings(fine, 0.5)
        middle, width = (first + last) / 2, last - first
        frame = interpolated(fine, middle[:, None] + width[:, None] * PLACES)
        values = gaussian_filter1d(frame, _SMOOTH / (PLACES[1] - PLACES[0]), axis=1, mode="constant")
    values[~(fine.max(axis=1) > 0)] = np.nan
    return values, width * step_s


def level_crossings(force_n: Floats, level: float) -> tuple[Floats, Floats]:
    """Steps (n,): where pulses (n, m) last rise above `level` of their peak before it, and fall below behind it.

    The ends of the series where they do not.
    """
    from .kernel import crossings

    steps = np.empty((2, len(force_n)))
    crossings(np.ascontiguousarray(force_n), np.argmax(force_n, axis=1), level, steps)
    return steps[0], steps[1]


def interpolated(values: Floats, place: Floats) -> Floats:
    """(n, k) of series (n, m) at places (n, k) in steps: straight between the points, 0 outside of them."""
    last = values.shape[1] - 1
    inside = (place >= 0) & (place <= last)
    place = np.where(inside, place, 0.0)
    step = np.minimum(place.astype(np.intp), last - 1)
    rows = np.arange(len(values))[:, None]
    before, after = values[rows, step], values[rows, step + 1]
    return np.where(inside, before + (place - step) * (after - before), 0.0)


def _refined(force: Floats, step: float, width_s: float) -> tuple[Floats, float]:
    """By a spline of the fifth degree through the samples, with nothing before and after them."""
    from scipy.interpolate import make_interp_spline

    finer = int(np.ceil(_POINTS * step / width_s))
    if finer == 1:
        return force, step
    index = np.arange(force.shape[1])
    spline = make_interp_spline(index, force, k=min(5, force.shape[1] - 1), axis=1)
    return np.asarray(spline(np.arange((len(index) - 1) * finer + 1) / finer)), step / finer
