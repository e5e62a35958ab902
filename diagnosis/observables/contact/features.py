"""Numbers that a force pulse is compared by: one function for measured and for simulated pulses.

Sampled pulses brought into a frame of their own, where pulses of any duration and sampling rate
compare.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.polynomial.legendre import legvander

from ....array_types import Floats, Rows
from ...record import Series
from ..base import Observable

#: Places of the frame, in widths at half the peak from the middle of that width.
PLACES = np.linspace(-1.6, 3.4, 501)
#: The frame is smoothed by a Gauss window of this deviation, in the same widths: less noise,
#: whatever the rate.
_SMOOTH = 0.03
#: Points to a width at half the peak: samples are refined by a spline up to it, and averaged down
#: to it.
_POINTS, _MOST = 150, 96


def framed(force_n: Floats, step_s: float, width_s: float | None = None) -> tuple[Floats, Floats]:
    """Pulses (n, m) in steps of `step_s`, of similar width, at `PLACES` (n, p), not smoothed yet,
    and their widths at half the peak (n,).

    Beyond their ends there is no force. The pulse is what surrounds the greatest force: of several
    contacts the strongest. Rows without any force above 0 are NaN. Expects the zero line to be
    removed. `width_s`, some width at half the peak that tells how finely to look, is the narrowest
    pulse's unless given.
    """
    if width_s is None:
        width_s = (
            max(int((force_n > 0.5 * force_n.max(axis=1, keepdims=True)).sum(axis=1).min()), 1)
            * step_s
        )
    if (count := int(width_s / step_s / _MOST)) >= 2:  # many more samples than the frame can use
        whole = force_n.shape[1] // count * count
        force_n, step_s = (
            force_n[:, :whole].reshape(len(force_n), -1, count).mean(axis=2),
            step_s * count,
        )
    fine, step_s = _refined(force_n, step_s, width_s)
    with np.errstate(invalid="ignore", divide="ignore"):
        first, last = level_crossings(fine, 0.5)
        middle, width = (first + last) / 2, last - first
        frame = interpolated(fine, middle[:, None] + width[:, None] * PLACES)
    frame[~(fine.max(axis=1) > 0)] = np.nan
    return frame, width * step_s


def level_crossings(force_n: Floats, level: float) -> tuple[Floats, Floats]:
    """Steps (n,): where pulses (n, m) last rise above `level` of their peak before it, and fall
    below behind it.

    The ends of the series where they do not.
    """

    steps = np.empty((2, len(force_n)))
    crossings(np.ascontiguousarray(force_n), np.argmax(force_n, axis=1), level, steps)
    return steps[0], steps[1]


def interpolated(values: Floats, place: Floats) -> Floats:
    """(n, k) of series (n, m) at places (n, k) in steps: straight between the points, 0 outside of
    them."""
    between = np.empty(place.shape)
    interpolate(
        np.ascontiguousarray(values, dtype=np.float64), np.ascontiguousarray(place), between
    )
    return between


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate(values, place, between):  # type: ignore[no-untyped-def]
    """Into `between` (n, k): series `values` (n, m) at places (n, k); 0 outside of the points and
    where there is no place (NaN)."""
    last = values.shape[1] - 1
    for i in range(place.shape[0]):
        for j in range(place.shape[1]):
            where = place[i, j]
            if not 0.0 <= where <= last:
                between[i, j] = 0.0
                continue
            step = min(int(where), last - 1)
            before = values[i, step]
            between[i, j] = before + (where - step) * (values[i, step + 1] - before)


def _refined(force: Floats, step: float, width_s: float) -> tuple[Floats, float]:
    """By a spline of the fifth degree through the samples, with nothing before and after them."""
    finer = int(np.ceil(_POINTS * step / width_s))
    if finer == 1:
        return force, step
    spline = _Spline.of(force.shape[1], finer)
    return spline.finer(force), step / finer


@dataclass(frozen=True, eq=False)
class _Spline:
    """Interpolating splines through m samples at even steps, at so many times as many places: the
    same linear map for all series. `factors` and `pivots` solve for the coefficients, a band of
    width 2 k + 1 about the diagonal. Between samples t and t + 1 the values are `weights[t]`
    (k + 1, places) of the coefficients from `first[t]` on; the last of the m - 1 spans are the
    places from the last sample on, which is one."""

    degree: int
    factors: Floats
    pivots: Rows
    first: Rows
    weights: Floats

    @classmethod
    @lru_cache(maxsize=32)
    def of(cls, samples: int, finer: int) -> _Spline:
        from scipy.interpolate import BSpline, make_interp_spline
        from scipy.linalg.lapack import dgbtrf

        degree = min(5, samples - 1)
        index = np.arange(samples, dtype=np.float64)
        knots = make_interp_spline(index, index, k=degree).t
        at_samples = BSpline.design_matrix(index, knots, degree)
        band = np.zeros((3 * degree + 1, samples))
        sample_matrix = at_samples.toarray()
        for offset in range(-degree, degree + 1):
            diagonal = np.diagonal(sample_matrix, offset)
            band[2 * degree - offset, max(offset, 0) : max(offset, 0) + len(diagonal)] = diagonal
        factors, pivots, _ = dgbtrf(band, degree, degree)
        places = np.minimum(np.arange(samples * finer) / finer, samples - 1)
        weights = BSpline.design_matrix(places, knots, degree).data.reshape(samples, finer, -1)
        first = at_samples.indices.reshape(samples, -1)[:, 0].astype(np.intp)
        return cls(degree, factors, pivots, first, np.ascontiguousarray(weights.transpose(0, 2, 1)))

    def finer(self, values: Floats) -> Floats:
        """(n, p) of series (n, m)."""
        from scipy.linalg.lapack import dgbtrs

        coefficients, _ = dgbtrs(self.factors, self.degree, self.degree, values.T, self.pivots)
        samples, _, finer = self.weights.shape
        fine = np.zeros((len(values), (samples - 1) * finer + 1))
        refine(coefficients.T, self.first, self.weights, fine)
        return fine


@njit(cache=True, nogil=True, error_model="numpy")
def refine(coefficients, first, weights, fine):  # type: ignore[no-untyped-def]
    """Into `fine` (n, p), which is 0: splines of `coefficients` (n, m), as `_Spline` has them."""
    samples, count, finer = weights.shape
    for i in range(len(fine)):
        for t in range(samples):
            span = fine[i, t * finer : (t + 1) * finer]
            for k in range(count):
                factor, shares = coefficients[i, first[t] + k], weights[t, k]
                for place in range(len(span)):
                    span[place] += shares[place] * factor


#: Level of the peak between which a pulse's shape is taken; the tails below it are mostly noise.
_LEVEL = 0.1
#: How far beyond these two instants the impulse is counted, over the time between them.
_BEYOND = 0.25
#: What comes later than so many widths at half the peak after their middle, where Hertz' contact
#: ended at 0.75, came after the contact: a second hit, a cell that rings.
_AFTER = 1.0
#: The apex is the centre of what is above this level.
_CAP = 0.8
_PHASES = (np.arange(32) + 0.5) / 32
#: Fixed shape functions, orthonormal over the phases: skew, fatness, and two finer ones.
_SHAPES = legvander(2 * _PHASES - 1, 4)[:, 1:] * np.sqrt([3, 5, 7, 9]) / _PHASES.size

_HEIGHT, _LENGTH = ("height",), ("length",)
#: Name, tolerance, floor, parts: what is wrong with a height or a length is wrong with all that is
#: made of it. The tolerance is the stated one of a peak force, 3 %, for amplitude and time alike.
#: The floors are those of sensors, not of hands: load cells are linear within 1 % of a reading, and
#: their calibration is as good (ISO 7626-5, data sheets of impact hammers); a width is a time at a
#: level, so it takes the same error of the level over the slope of the pulse there, half of it;
#: shares of the peak likewise.
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
    """A force without its zero line: the median of what precedes the contact, where that is four
    samples or more."""
    before = series.values[series.time_s < -1.5 / series.sampling_rate_hz]
    zero = float(np.median(before)) if before.size >= 4 else 0.0
    return replace(series, values=series.values - zero)


def features(force_n: Floats, step_s: float, width_s: float | None = None) -> Floats:
    """(n, d) of pulses (n, m) of similar width, in steps of `step_s`, the zero line removed; NaN
    without force. `width_s` as in `framed`."""
    return frame_features([framed(force_n, step_s, width_s)])


def frame_features(framed_pulses: Sequence[tuple[Floats, Floats]]) -> Floats:
    """(n, d) of all pulses of what `framed` gave, one after the other; NaN without force.

    `ln_impulse` is of the force from a quarter of the pulse's width before it to a quarter after;
    `rise_share` is from a tenth of the peak to the apex, over the width at a tenth. The shape is
    force over peak between the instants of a tenth, against Legendre's polynomials of order 1 to 4:
    order 0 is told by peak, impulse and width. `after_share` is the impulse after the contact over
    that of the frame.
    """
    from scipy.ndimage import gaussian_filter1d

    frame, frame_width_s = (np.concatenate(parts) for parts in zip(*framed_pulses, strict=True))
    deviation = _SMOOTH / (PLACES[1] - PLACES[0])
    force = gaussian_filter1d(np.nan_to_num(frame), deviation, axis=1, mode="constant")
    ends = np.cumsum([len(width) for _, width in framed_pulses])[:-1]
    with np.errstate(invalid="ignore", divide="ignore"):
        peak = _peak(force)
        low, high = level_crossings(force, _LEVEL)
        first, last = level_crossings(force, 0.5)
        unit = PLACES[1] - PLACES[0]
        shape = _clipped(force, low[:, None] + (high - low)[:, None] * _PHASES) / peak[:, None]
        # Part by part: the last digits of a product and of these sums depend on the number of rows.
        late_force = np.concatenate(
            [part[:, PLACES > _AFTER].sum(axis=1) for part in np.split(force, ends)]
        )
        values = np.column_stack(
            [
                np.log(peak),
                np.log(_impulse(force, low, high) * unit * frame_width_s),
                np.log((last - first) * unit * frame_width_s),
                np.log((high - low) * unit * frame_width_s),
                (_apex(force, peak) - low) / (high - low),
                np.concatenate([part @ _SHAPES for part in np.split(shape, ends)]),
                late_force / force.sum(axis=1),
            ]
        )
    values[~np.isfinite(values).all(axis=1) | np.isnan(frame).any(axis=1)] = np.nan
    return np.asarray(values)


def _peak(force: Floats) -> Floats:
    """The summit of the parabola through the greatest point and its neighbours."""
    rows, top = np.arange(len(force)), np.argmax(force, axis=1).clip(1, force.shape[1] - 2)
    before, here, behind = force[rows, top - 1], force[rows, top], force[rows, top + 1]
    bend = before - 2 * here + behind
    return np.asarray(
        here - np.where(bend < 0, (behind - before) ** 2 / (8 * np.where(bend < 0, bend, 1.0)), 0.0)
    )


def _apex(force: Floats, peak: Floats) -> Floats:
    """Centre of the cap, in steps: smoother than the place of the greatest force, which is flat."""
    cap = np.maximum(force - _CAP * peak[:, None], 0.0)
    return np.asarray((cap * np.arange(force.shape[1])).sum(axis=1) / cap.sum(axis=1))


def _impulse(force: Floats, low: Floats, high: Floats) -> Floats:
    """Sum of the force in steps, both ends to a fraction of a step."""
    beyond = _BEYOND * (high - low)
    total = np.zeros(force.shape)
    integrate(force, total)
    ends = _clipped(total, np.stack([low - beyond, high + beyond], axis=1))
    return np.asarray(ends[:, 1] - ends[:, 0])


@njit(cache=True, nogil=True, error_model="numpy")
def integrate(force, total):  # type: ignore[no-untyped-def]
    """Into `total` (n, m), which is 0: sums of pulses (n, m) by trapezoids up to each point."""
    for i in range(len(force)):
        row, sums = force[i], total[i]
        for j in range(1, len(row)):
            sums[j] = sums[j - 1] + (row[j] + row[j - 1]) / 2


def _clipped(values: Floats, place: Floats) -> Floats:
    """As `interpolated`, with the first and the last value outside of the points."""
    return interpolated(values, np.clip(place, 0.0, values.shape[1] - 1))


@njit(cache=True, nogil=True, error_model="numpy")
def crossings(force, top, level, steps):  # type: ignore[no-untyped-def]
    """Into `steps` (2, n): where pulses (n, m) cross `level` of their peak at `top` (n,), before
    and behind it."""
    for i in range(len(force)):
        row, threshold, last = force[i], level * force[i, top[i]], force.shape[1] - 1
        before, after = top[i] - 1, top[i] + 1
        while before >= 0 and not row[before] < threshold:
            before -= 1
        while after <= last and not row[after] < threshold:
            after += 1
        steps[0, i] = 0.0 if before < 0 else _crossing(row, before, threshold)
        steps[1, i] = last if after > last else _crossing(row, after - 1, threshold)


@njit(cache=True, nogil=True, error_model="numpy")
def _crossing(row, side, threshold):  # type: ignore[no-untyped-def]
    """Straight between two points; the first of them where both are alike."""
    here, there = row[side], row[side + 1]
    return side + (threshold - here) / (there - here) if there != here else float(side)
