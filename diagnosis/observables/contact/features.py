"""Numbers that a force pulse is compared by: one function for measured and for simulated pulses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.polynomial.legendre import legvander

from ....array_types import Floats
from ...record import Series
from ..base import Observable
from .time_frame import PLACES, framed, interpolated, level_crossings

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
_SHAPES = legvander(2 * _PHASES - 1, 4)[:, 1:] * np.sqrt([3, 5, 7, 9]) / _PHASES.size

_HEIGHT, _LENGTH = ("height",), ("length",)
#: Name, tolerance, floor, parts: what is wrong with a height or a length is wrong with all that is made of it. The
#: tolerance is the stated one of a peak force, 3 %, for amplitude and time alike. The floors are those of sensors, not
#: of hands: load cells are linear within 1 % of a reading, and their calibration is as good (ISO 7626-5, data sheets of
#: impact hammers); a width is a time at a level, so it takes the same error of the level over the slope of the pulse
#: there, half of it; shares of the peak likewise.
_COLUMNS: tuple[tuple[str, float, float, tuple[str, ...]], ...] = (
    ("ln_peak", 0.03, 0.010, _HEIGHT),
    ("ln_impulse", 0.03, 0.010, _HEIGHT + _LENGTH),
    ("ln_width_half", 0.03, 0.005, _LENGTH),
    ("ln_width_tenth", 0.03, 0.007, _LENGTH),
    *((name, 0.02, 0.005, ()) for name in ("rise_share", "skew", "fatness", "shape_3", "shape_4")),
    ("after_share", 0.03, 0.005, ()),
)
OBSERVABLES = tuple(
    Observable(name, "contact", "force", "1", tolerance, floor, detail=not parts, parts=parts)
    for name, tolerance, floor, parts in _COLUMNS
)
NAMES = tuple(item.name for item in OBSERVABLES)


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
    frame, frame_width_s = framed(force_n, step_s, width_s)
    force = np.nan_to_num(frame)
    with np.errstate(invalid="ignore", divide="ignore"):
        peak = _peak(force)
        low, high = level_crossings(force, _LEVEL)
        first, last = level_crossings(force, 0.5)
        unit = PLACES[1] - PLACES[0]
        shape = _clipped(force, low[:, None] + (high - low)[:, None] * _PHASES) / peak[:, None]
        values = np.column_stack(
            [
                np.log(peak),
                np.log(_impulse(force, low, high) * unit * frame_width_s),
                np.log((last - first) * unit * frame_width_s),
                np.log((high - low) * unit * frame_width_s),
                (_apex(force, peak) - low) / (high - low),
                shape @ _SHAPES,
                force[:, PLACES > _AFTER].sum(axis=1) / force.sum(axis=1),
            ]
        )
    values[~np.isfinite(values).all(axis=1) | np.isnan(frame).any(axis=1)] = np.nan
    return np.asarray(values)


def _peak(force: Floats) -> Floats:
    """The summit of the parabola through the greatest point and its neighbours."""
    rows, top = np.arange(len(force)), np.argmax(force, axis=1).clip(1, force.shape[1] - 2)
    before, here, behind = force[rows, top - 1], force[rows, top], force[rows, top + 1]
    bend = before - 2 * here + behind
    return np.asarray(here - np.where(bend < 0, (behind - before) ** 2 / (8 * np.where(bend < 0, bend, 1.0)), 0.0))


def _apex(force: Floats, peak: Floats) -> Floats:
    """Centre of the cap, in steps: smoother than the place of the greatest force, which is flat."""
    cap = np.maximum(force - _CAP * peak[:, None], 0.0)
    return np.asarray((cap * np.arange(force.shape[1])).sum(axis=1) / cap.sum(axis=1))


def _impulse(force: Floats, low: Floats, high: Floats) -> Floats:
    """Sum of the force in steps, both ends to a fraction of a step."""
    beyond = _BEYOND * (high - low)
    total = np.pad(np.cumsum((force[:, 1:] + force[:, :-1]) / 2, axis=1), ((0, 0), (1, 0)))
    ends = _clipped(total, np.stack([low - beyond, high + beyond], axis=1))
    return np.asarray(ends[:, 1] - ends[:, 0])


def _clipped(values: Floats, place: Floats) -> Floats:
    """As `interpolated`, with the first and the last value outside of the points."""
    return interpolated(values, np.clip(place, 0.0, values.shape[1] - 1))
