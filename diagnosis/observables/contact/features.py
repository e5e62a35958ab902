"""Numbers that a force pulse is compared by: one function for measured and for simulated pulses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.polynomial.legendre import legval

from ...record import Series
from ..base import Observable
from .time_frame import PLACES, Floats, Framed, framed, level_crossings

#: Level of the peak between which a pulse's shape is taken; the tails below it are mostly noise.
_LEVEL = 0.1
#: How far beyond these two instants the impulse is counted, over the time between them.
_BEYOND = 0.25
#: What comes later than so many widths at half the peak after their middle, where Hertz' contact ended at 0.75, came
#: after the contact: a second hit, a cell that rings.
_AFTER = 1.0
#: The apex is the centre of what is above this level.
_CAP = 0.8
_PHASES = (np.arange(32) + 0.5) / 32
#: Fixed shape functions, orthonormal over the phases: skew, fatness, and two finer ones.
_SHAPES = np.stack([np.sqrt(2 * k + 1) * legval(2 * _PHASES - 1, np.eye(5)[k]) for k in (1, 2, 3, 4)]) / len(_PHASES)

#: Name, unit, tolerance, floor. The tolerance is the stated one of a peak force, 3 %, for amplitude and time alike.
#: The floors are those of sensors, not of hands: load cells are linear within 1 % of a reading, and their calibration
#: is as good (ISO 7626-5, data sheets of impact hammers); a width is a time at a level, so it takes the same error of
#: the level over the slope of the pulse there, half of it; shares of the peak likewise.
_COLUMNS = (
    ("ln_peak", "1", 0.03, 0.010),
    ("ln_impulse", "1", 0.03, 0.010),
    ("ln_width_half", "1", 0.03, 0.005),
    ("ln_width_tenth", "1", 0.03, 0.007),
    ("rise_share", "1", 0.02, 0.005),
    ("skew", "1", 0.02, 0.005),
    ("fatness", "1", 0.02, 0.005),
    ("shape_3", "1", 0.02, 0.005),
    ("shape_4", "1", 0.02, 0.005),
    ("after_share", "1", 0.03, 0.005),
)

#: What is wrong with a height or a length is wrong with all that is made of it.
_PARTS = {
    "ln_peak": ("height",),
    "ln_impulse": ("height", "length"),
    "ln_width_half": ("length",),
    "ln_width_tenth": ("length",),
}
OBSERVABLES = tuple(
    Observable(name, "contact", "force", unit, tolerance, floor, detail=name not in _PARTS, parts=_PARTS.get(name, ()))
    for name, unit, tolerance, floor in _COLUMNS
)
NAMES = tuple(one.name for one in OBSERVABLES)


def series_features(series: Series) -> Floats:
    """(d,) of one recorded pulse, its zero line removed; NaN where there is none."""
    values = zeroed(series).values
    if values.size < 4 or not np.all(np.isfinite(values)):
        return np.full(len(NAMES), np.nan)
    return np.asarray(features(values[None], 1 / series.sampling_rate_hz)[0])


def zeroed(series: Series) -> Series:
    """A force without its zero line: the median of what precedes the contact, where that is four samples or more."""
    before = series.values[series.time_s < -1.5 / series.sampling_rate_hz]
    zero = float(np.median(before)) if before.size >= 4 else 0.0
    return replace(series, values=series.values - zero)


def features(force_n: Floats, step_s: float, width_s: float | None = None) -> Floats:
    """(n, d) of pulses (n, m) of similar width, in steps of `step_s`, the zero line removed; NaN without force.

    `width_s` as in `framed`.

    `ln_impulse` is of the force from a quarter of the pulse's width before it to a quarter after; `rise_share` is from
    a tenth of the peak to the apex, over the width at a tenth. The shape is force over peak between the instants of a
    tenth, against Legendre's polynomials of order 1 to 4: order 0 is told by peak, impulse and width. `after_share` is
    the impulse after the contact over that of the frame.
    """
    return _features(framed(force_n, step_s, width_s))


def _features(frame: Framed) -> Floats:
    force = np.nan_to_num(frame.force_n)
    with np.errstate(invalid="ignore", divide="ignore"):
        peak = _peak(force)
        low, high = level_crossings(force, _LEVEL)
        first, last = level_crossings(force, 0.5)
        unit = PLACES[1] - PLACES[0]
        width = (high - low) * unit * frame.width_s
        found = np.column_stack(
            [
                np.log(peak),
                np.log(_impulse(force, low, high) * unit * frame.width_s),
                np.log((last - first) * unit * frame.width_s),
                np.log(width),
                (_apex(force, peak) - low) / (high - low),
                _between(force, low, high) / peak[:, None] @ _SHAPES.T,
                force[:, PLACES > _AFTER].sum(axis=1) / force.sum(axis=1),
            ]
        )
    found[~np.isfinite(found).all(axis=1) | np.isnan(frame.force_n).any(axis=1)] = np.nan
    return np.asarray(found)


def _peak(force: Floats) -> Floats:
    """The summit of the parabola through the greatest point and its neighbours."""
    rows, top = np.arange(len(force)), np.argmax(force, axis=1).clip(1, force.shape[1] - 2)
    left, here, right = force[rows, top - 1], force[rows, top], force[rows, top + 1]
    bend = left - 2 * here + right
    return np.asarray(here - np.where(bend < 0, (right - left) ** 2 / (8 * np.where(bend < 0, bend, 1.0)), 0.0))


def _apex(force: Floats, peak: Floats) -> Floats:
    """Centre of the cap, in steps: smoother than the place of the greatest force, which is flat."""
    cap = np.maximum(force - _CAP * peak[:, None], 0.0)
    return np.asarray((cap * np.arange(force.shape[1])).sum(axis=1) / cap.sum(axis=1))


def _impulse(force: Floats, low: Floats, high: Floats) -> Floats:
    """Sum of the force in steps, both ends to a fraction of a step."""
    beyond = _BEYOND * (high - low)
    total = np.concatenate([np.zeros((len(force), 1)), np.cumsum((force[:, 1:] + force[:, :-1]) / 2, axis=1)], axis=1)
    return np.asarray(_interpolated(total, (high + beyond)[:, None]) - _interpolated(total, (low - beyond)[:, None]))[
        :, 0
    ]


def _between(force: Floats, low: Floats, high: Floats) -> Floats:
    return _interpolated(force, low[:, None] + (high - low)[:, None] * _PHASES)


def _interpolated(values: Floats, place: Floats) -> Floats:
    last = values.shape[1] - 1
    place = np.clip(place, 0.0, last)
    left = np.minimum(place.astype(np.intp), last - 1)
    rows = np.arange(len(values))[:, None]
    return np.asarray(values[rows, left] + (place - left) * (values[rows, left + 1] - values[rows, left]))
