"""Acceleration to shock response spectrum, after ISO 18431-4.

What a spectrum is asked of, refused where it makes no sense.

A shock response spectrum.

Lines of a spectrum: so many to an octave (ISO 18431-4: 6 for 5 % damping).

The response of one oscillator over time, for a plot: a spectrum keeps no series.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from . import coefficients
from .coefficients import steps
from .resampling import upsampled
from .sampling_bound import RecordContent, SamplingBound

PER_OCTAVE = 6
#: Ten samples a cycle: what a record shows of a line above is off by more than 8 %.
SAMPLES_PER_CYCLE = 10.0


def octave_grid(low_hz: float, high_hz: float, per_octave: int = PER_OCTAVE) -> Floats:
    """Lines in equal ratios; the step to the last one may be shorter.

    Parameters:
        low_hz: The first line, Hz.
        high_hz: The last line, Hz.
        per_octave: Lines to an octave.

    Returns:
        The lines (f,) in Hz.

    Raises:
        ValueError: For ends that are no range, and for less than one line to an octave.
    """
    if not (0 < low_hz <= high_hz < math.inf):
        raise ValueError(f"lines from {low_hz!r} to {high_hz!r} Hz: expected 0 < low <= high")
    if per_octave < 1:
        raise ValueError(f"per_octave = {per_octave!r}: expected 1 or more")
    count = math.floor(per_octave * math.log2(high_hz / low_hz) + 1e-9)
    lines = low_hz * 2 ** (np.arange(count + 1) / per_octave)
    if lines[-1] < high_hz * (1 - 1e-9):
        return np.append(lines, high_hz)
    lines[-1] = high_hz
    return np.asarray(lines)


def grid_of_record(samples: int, sampling_rate_hz: float, per_octave: int = PER_OCTAVE) -> Floats:
    """The lines (f,) in Hz from one cycle in the record up to `SAMPLES_PER_CYCLE`.

    Parameters:
        samples: The number of samples in the record.
        sampling_rate_hz: Its sampling rate.
        per_octave: Lines to an octave; by default 6, which ISO 18431-4 asks for at 5 % damping.

    Raises:
        ValueError: For a record too short for a line.
    """
    low, high = sampling_rate_hz / samples, sampling_rate_hz / SAMPLES_PER_CYCLE
    if low > high:
        raise ValueError(
            f"{samples} samples: expected {SAMPLES_PER_CYCLE:g} or more, or "
            f"frequency_hz of your own"
        )
    return octave_grid(low, high, per_octave)


DEFAULT_Q = 10.0


def checked_records(acceleration: Floats) -> Floats:
    """Records (..., n) as contiguous numbers.

    Parameters:
        acceleration: Records (..., n) in m/s2. A record of zeros is allowed: a shot that fails is
            all 0.

    Raises:
        ValueError: For a record without samples, for a sample that is no number, and for a record
            that is constant at another value than 0.
    """
    # One kind of array: the compiled loop knows no other.
    records = np.require(acceleration, np.float64, ["C", "A", "W"])
    if records.ndim == 0 or records.size == 0:
        raise ValueError(
            f"acceleration has shape {records.shape}: expected (n,) or (..., n) with samples in it"
        )
    highest, lowest = records.max(axis=-1), records.min(axis=-1)  # NaN where a sample is NaN
    if not (np.isfinite(highest) & np.isfinite(lowest)).all():
        bad = np.argwhere(~np.isfinite(records))
        raise ValueError(
            f"acceleration has {len(bad)} samples that are no numbers, the first at {bad[0, -1]}"
        )
    stuck = (highest == lowest) & (highest != 0)
    if records.shape[-1] > 1 and np.any(stuck):
        raise ValueError(
            f"acceleration is constant at {highest[stuck].flat[0]:g} m/s2: is "
            f"the channel connected?"
        )
    return records


def checked_rate(sampling_rate_hz: float) -> float:
    """The sampling rate in Hz, where it is positive and finite.

    Parameters:
        sampling_rate_hz: The sampling rate of the records.

    Raises:
        ValueError: For any other number.
    """
    if not (math.isfinite(sampling_rate_hz) and sampling_rate_hz > 0):
        raise ValueError(f"sampling_rate_hz = {sampling_rate_hz!r}: expected a positive number")
    return float(sampling_rate_hz)


def checked_damping(q: float | None, damping_ratio: float | None) -> float:
    """The damping ratio of the oscillators, that of Q = 10 where neither is given.

    Parameters:
        q: Q of the oscillators, above 0.5; None where it is not given.
        damping_ratio: Their damping ratio, above 0 and below 1, in the place of `q`: 1/(2 Q); None
            where it is not given.

    Raises:
        ValueError: Where both are given, and for damping that is not below critical.
    """
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
    """Lines (f,) in Hz, in the order in which they are given.

    Parameters:
        frequency_hz: The lines (f,), in any order.
        sampling_rate_hz: The sampling rate of the record.

    Raises:
        ValueError: Where there is no line, for a line that is not positive, and for one at half the
            sampling rate or above.
    """
    lines = np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
    if lines.ndim != 1 or lines.size == 0 or not np.all(lines > 0):
        raise ValueError("frequency_hz: expected (f,) positive numbers, at least one")
    if not lines.max() < sampling_rate_hz / 2:
        raise ValueError(
            f"frequency_hz up to {lines.max():g}: expected below "
            f"{sampling_rate_hz / 2:g}, half the sampling rate; "
            "ask for lines below, or record faster: nothing above is in the record"
        )
    return lines


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Shock response spectra at `frequency_hz` (f,); arrays are (..., f), absolute acceleration in
    m/s2, >= 0.

    `positive` and `negative` are the largest responses either way over all time, `primary` the
    larger of both while the record lasts, `residual` after it; `maximax` is the largest of all.
    `pseudo_velocity_m_s` is the maximax of the relative displacement times omega. `resampled` (...)
    is the factor by which each record was resampled.
    """

    frequency_hz: Floats
    damping_ratio: float
    maximax: Floats
    positive: Floats
    negative: Floats
    primary: Floats
    residual: Floats
    pseudo_velocity_m_s: Floats
    resampled: NDArray[np.int64]
    sampling: Callable[[], SamplingBound] = field(repr=False)

    @property
    def q(self) -> float:
        return 1 / (2 * self.damping_ratio)

    @property
    def sampling_error(self) -> Floats:
        """The share of the maximax by which sampling may have changed it, at most, (..., f):
        infinite where the record bounds nothing. `sampling_bound.py` says what it assumes."""
        return self._bound.total

    @property
    def hidden_error(self) -> Floats:
        """The part of `sampling_error` of straight lines and of peaks between samples, (..., f)."""
        return self._bound.hidden

    @property
    def unseen_error(self) -> Floats:
        """The part of `sampling_error` of content above half the sampling rate, (..., f)."""
        return self._bound.unseen

    @property
    def high_share(self) -> Floats:
        """Of what passes and lies close to half the sampling rate, the largest over the record's
        largest, (...)."""
        return self._bound.high_share

    @cached_property
    def _bound(self) -> SamplingBound:
        # A transform of the record costs as much as many a spectrum, and most callers never ask.
        return self.sampling()


#: What straight lines between samples and peaks beside them may hide of a line, 0.09 dB: a tenth of
#: what calibrated accelerometers are uncertain by.
RESAMPLED_WITHIN = 0.01
#: Content at half the sampling rate has 32 samples to a cycle then, which hide 0.8 % of a peak.
MOST_RESAMPLED = 16
#: Samples that are resampled at a time.
_SAMPLES_AT_ONCE = 1 << 22


def shock_response_spectrum(
    acceleration: Floats,
    sampling_rate_hz: float,
    frequency_hz: Floats | Sequence[float] | None = None,
    *,
    q: float | None = None,
    damping_ratio: float | None = None,
    resample_within: float | None = RESAMPLED_WITHIN,
    threads: int | None = None,
) -> Spectrum:
    """The spectrum of each record.

    The base rests before the first sample, moves in straight lines from sample to sample, in one
    more step to 0 after the last, and rests. Peaks while the record lasts are those at samples; the
    peaks of the free decay after it are exact.

    Parameters:
        acceleration: Records (..., n) in m/s2.
        sampling_rate_hz: Their sampling rate, Hz.
        frequency_hz: The lines (f,) in Hz; by default those of `grid_of_record`.
        q: Q of the oscillators; by default 10.
        damping_ratio: Their damping ratio, in the place of `q`: 1/(2 Q).
        resample_within: The share of a line that straight lines and peaks between samples may hide
            at most. A record that hides more is resampled band-limited, once for all lines, by the
            least power of two that reaches it, at most by `MOST_RESAMPLED`. None takes every record
            as it is; `Spectrum.sampling_error` has what remains either way.
        threads: The largest number of threads; by default one to a processor.

    Raises:
        ValueError: For a record that is empty, constant or not all numbers, and for lines from half
            the sampling rate upwards.

    Source:
        ISO 18431-4.
    """
    records, rate = checked_records(acceleration), checked_rate(sampling_rate_hz)
    zeta = checked_damping(q, damping_ratio)
    lines = checked_lines(
        grid_of_record(records.shape[-1], rate) if frequency_hz is None else frequency_hz, rate
    )
    flat = records.reshape(-1, records.shape[-1])
    responses = _largest(flat, 2 * np.pi * lines / rate, zeta, threads)
    factors = np.ones(len(flat), dtype=np.int64)
    if resample_within is not None:
        _resample(
            flat, rate, lines, zeta, _checked_share(resample_within), threads, responses, factors
        )
    maximax = _maximax(responses)

    def sampling() -> SamplingBound:
        bounds = [
            _sampling_bound(flat[i : i + 1], rate, lines, zeta, int(factors[i]), maximax[i : i + 1])
            for i in range(len(flat))
        ]
        shape = records.shape[:-1]
        total, hidden, unseen = (
            np.concatenate([getattr(bound, name) for bound in bounds]).reshape(*shape, -1)
            for name in ("total", "hidden", "unseen")
        )
        return SamplingBound(
            total,
            hidden,
            unseen,
            np.concatenate([bound.high_share for bound in bounds]).reshape(shape),
        )

    peaks = _Peaks(*responses.reshape(6, *records.shape[:-1], lines.size))
    return peaks.spectrum(lines, zeta, factors.reshape(records.shape[:-1]), sampling)


def _sampling_bound(
    record: Floats, rate: float, lines: Floats, zeta: float, factor: int, maximax: Floats
) -> SamplingBound:
    """Of one record (1, n) and its spectrum (1, f)."""
    from .difference_bound import hidden_by_differences

    by_differences = hidden_by_differences(
        upsampled(record, factor), rate * factor, lines, zeta, maximax
    )
    return RecordContent.of(record, rate).bound(lines, zeta, factor, maximax, by_differences)


def _checked_share(resample_within: float) -> float:
    if not 0 < resample_within < 1:
        raise ValueError(
            f"resample_within = {resample_within!r}: expected a share above 0 and below 1, or None"
        )
    return resample_within


def _maximax(responses: Floats) -> Floats:
    """(k, f) of the fields of `_Peaks`."""
    return np.asarray(
        np.maximum(np.maximum(responses[0], responses[1]), np.maximum(responses[3], responses[4]))
    )


def _resample(
    records: Floats,
    rate: float,
    lines: Floats,
    zeta: float,
    share: float,
    threads: int | None,
    responses: Floats,
    factors: NDArray[np.int64],
) -> None:
    """Puts the responses (6, k, f) of resampled records, and their factors (k,), where the records
    need it."""
    from .difference_bound import hidden_by_differences

    at_once = max(1, _SAMPLES_AT_ONCE // (MOST_RESAMPLED * records.shape[-1]))
    maximax = _maximax(responses)
    # Infinite where the differences settle the line: it is fine at any factor, whatever the
    # content's bound says.
    limit = np.where(
        hidden_by_differences(records, rate, lines, zeta, maximax) > share * maximax,
        share * maximax,
        np.inf,
    )
    doubtful = np.flatnonzero(np.isfinite(limit).any(axis=-1))
    for first in range(0, doubtful.size, at_once):
        rows = doubtful[first : first + at_once]
        tested = np.flatnonzero(np.isfinite(limit[rows]).any(axis=0))
        content = RecordContent.of(records[rows], rate)
        factor = 1
        while rows.size:
            at = np.ix_(rows, tested)
            fine = content.fine(lines[tested], zeta, factor, maximax[at], limit[at])
            settled = fine if factor < MOST_RESAMPLED else np.ones_like(fine)
            if factor > 1 and settled.any():
                theta = 2 * np.pi * lines / (rate * factor)
                responses[:, rows[settled]] = _largest(
                    upsampled(records[rows[settled]], factor), theta, zeta, threads
                )
                factors[rows[settled]] = factor
            rows, content = rows[~settled], content.take(np.flatnonzero(~settled))
            factor *= 2


@dataclass(frozen=True, eq=False)
class _Peaks:
    """Largest responses of either sign, >= 0, while the record lasts and after it; p is omega^2
    times displacement."""

    up: Floats
    down: Floats
    p: Floats
    up_after: Floats
    down_after: Floats
    p_after: Floats

    def spectrum(
        self,
        lines: Floats,
        zeta: float,
        resampled: NDArray[np.int64],
        sampling: Callable[[], SamplingBound],
    ) -> Spectrum:
        primary, residual = (
            np.maximum(self.up, self.down),
            np.maximum(self.up_after, self.down_after),
        )
        return Spectrum(
            frequency_hz=lines,
            damping_ratio=zeta,
            maximax=np.maximum(primary, residual),
            positive=np.maximum(self.up, self.up_after),
            negative=np.maximum(self.down, self.down_after),
            primary=primary,
            residual=residual,
            pseudo_velocity_m_s=np.maximum(self.p, self.p_after) / (2 * np.pi * lines),
            resampled=resampled,
            sampling=sampling,
        )


def _largest(records: Floats, theta: Floats, zeta: float, threads: int | None) -> Floats:
    """The fields of `_Peaks`, (6, k, f). After the record p' = v and v' = -p - 2 zeta v."""
    from .kernel import run

    highest, lowest, furthest, p, v = run(records, steps(theta, zeta), threads)
    x = p + 2 * zeta * v
    up, down = coefficients.extremes(x, v - 2 * zeta * x, zeta)
    p_up, p_down = coefficients.extremes(p, v, zeta)
    return np.stack(
        [
            highest,
            -lowest,
            furthest,
            np.maximum(up, 0),
            np.maximum(-down, 0),
            np.maximum(p_up, -p_down),
        ]
    )


@dataclass(frozen=True, eq=False)
class Response:
    """At each sample of the record, (n,): what the mass feels, and how far it is from its place on
    the base."""

    frequency_hz: float
    damping_ratio: float
    absolute_acceleration_m_s2: Floats
    relative_displacement_m: Floats


def oscillator_response(
    acceleration: Floats,
    sampling_rate_hz: float,
    frequency_hz: float,
    *,
    q: float | None = None,
    damping_ratio: float | None = None,
) -> Response:
    """The response of one oscillator, at rest before the first sample, to one record.

    Parameters:
        acceleration: The record (n,) in m/s2.
        sampling_rate_hz: Its sampling rate.
        frequency_hz: The natural frequency of the oscillator.
        q: Q of the oscillator; by default 10.
        damping_ratio: Its damping ratio, in the place of `q`: 1/(2 Q).

    Raises:
        ValueError: For more than one record, and for what `shock_response_spectrum` refuses.
    """
    from .kernel import run_series

    record, rate = checked_records(acceleration), checked_rate(sampling_rate_hz)
    if record.ndim != 1:
        raise ValueError(f"acceleration has shape {record.shape}: expected one record (n,)")
    zeta, omega = checked_damping(q, damping_ratio), 2 * np.pi * checked_lines([frequency_hz], rate)
    step_values = steps(omega / rate, zeta)
    series = np.empty((2, record.size))
    run_series(
        record,
        step_values.g[0],
        step_values.s[0],
        step_values.h[0],
        (step_values.g / step_values.theta)[0],
        2 * zeta,
        series,
    )
    p, v = series
    return Response(float(frequency_hz), zeta, p + 2 * zeta * v, -p / omega[0] ** 2)
