"""Acceleration to shock response spectrum, after ISO 18431-4.

What a spectrum is asked of, refused where it makes no sense.

A record at a multiple of its sampling rate, limited to the band that it has.

A shock response spectrum.

Lines of a spectrum: so many to an octave (ISO 18431-4: 6 for 5 % damping).

The response of one oscillator over time, for a plot: a spectrum keeps no series.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from . import coefficients
from .coefficients import steps

PER_OCTAVE = 6
#: Ten samples a cycle: what a record shows of a line above is off by more than 8 %.
SAMPLES_PER_CYCLE = 10.0


def octave_grid(low_hz: float, high_hz: float, per_octave: int = PER_OCTAVE) -> Floats:
    """Lines from `low_hz` in equal ratios, and `high_hz` as the last one, whose step may be shorter.

    Raises `ValueError` for ends that are no range and for less than one line to an octave.
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
    """From one cycle in the record up to `SAMPLES_PER_CYCLE`. Raises `ValueError` for a record too short for a line."""
    low, high = sampling_rate_hz / samples, sampling_rate_hz / SAMPLES_PER_CYCLE
    if low > high:
        raise ValueError(f"{samples} samples: expected {SAMPLES_PER_CYCLE:g} or more, or frequency_hz of your own")
    return octave_grid(low, high, per_octave)


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


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Shock response spectra at `frequency_hz` (f,); arrays are (..., f), absolute acceleration in m/s2, >= 0.

    `positive` and `negative` are the largest responses either way over all time, `primary` the larger of both while the
    record lasts, `residual` after it; `maximax` is the largest of all. `pseudo_velocity_m_s` is the maximax of the
    relative displacement times omega. `sampling_error` (f,): how much of a peak may be missed between samples,
    relative, at most.
    """

    frequency_hz: Floats
    damping_ratio: float
    maximax: Floats
    positive: Floats
    negative: Floats
    primary: Floats
    residual: Floats
    pseudo_velocity_m_s: Floats
    sampling_error: Floats

    @property
    def q(self) -> float:
        return 1 / (2 * self.damping_ratio)


#: Zeros that keep the end of a record from ringing into its beginning: the transform takes a record for a circle.
_GUARD = 64
#: Leaves 8e-6 of an error; more only costs memory.
MOST_SAMPLES_PER_CYCLE = 1000.0


def upsampled(acceleration: Floats, factor: int) -> Floats:
    """(k, n) to (k, (n - 1) factor + 1), each old sample kept: zeros put between the samples and the images removed.

    Exact for a record without content above half the sampling rate that begins and ends at rest; a jump rings.
    """
    if factor == 1:
        return acceleration
    from scipy.fft import irfft, next_fast_len, rfft

    n = acceleration.shape[-1]
    length = next_fast_len(n + _GUARD, real=True)
    length += length % 2
    spectrum = rfft(acceleration, length)
    spectrum[..., -1] *= 0.5  # the line at half the sampling rate stands for two of the finer record's
    return np.asarray(factor * irfft(spectrum, factor * length)[..., : (n - 1) * factor + 1])


def factors(frequency_hz: Floats, sampling_rate_hz: float, samples_per_cycle: float | None) -> NDArray[np.int64]:
    """The least power of two for each line (f,) that gives it `samples_per_cycle`; 1 for None.

    Raises `ValueError` for a number that is not finite and positive.
    """
    if samples_per_cycle is None:
        return np.ones(frequency_hz.size, dtype=np.int64)
    if not 0 < samples_per_cycle <= MOST_SAMPLES_PER_CYCLE:
        raise ValueError(
            f"resample = {samples_per_cycle!r}: expected samples per cycle, above 0, up to {MOST_SAMPLES_PER_CYCLE:g}"
        )
    wanted = np.maximum(samples_per_cycle * frequency_hz / sampling_rate_hz, 1.0)
    return np.asarray(2 ** np.ceil(np.log2(wanted) - 1e-12).astype(np.int64))


def shock_response_spectrum(
    acceleration: Floats,
    sampling_rate_hz: float,
    frequency_hz: Floats | Sequence[float] | None = None,
    *,
    q: float | None = None,
    damping_ratio: float | None = None,
    resample: float | None = None,
    threads: int | None = None,
) -> Spectrum:
    """Of each record in `acceleration` (..., n), m/s2, at `frequency_hz` (f,), by default `grid_of_record`'s.

    Q is 10 unless `q` or `damping_ratio` says otherwise. The base rests before the first sample, moves in straight
    lines from sample to sample, in one more step to 0 after the last, and rests. Peaks while the record lasts are those
    at samples; the peaks of the free decay after it are exact.

    `resample`: how many samples a cycle every line gets at least, by band-limited interpolation of the record: 30 leave
    an error of 1 %, 300 of 0.01 %. None takes the record as it is. `sampling_error` tells what remains either way.
    `threads`: at most so many, None for one to a processor.

    Raises `ValueError` for a record that is empty, constant or not all numbers, and for lines from half the sampling
    rate upwards.
    """
    records, rate = checked_records(acceleration), checked_rate(sampling_rate_hz)
    zeta = checked_damping(q, damping_ratio)
    lines = checked_lines(grid_of_record(records.shape[-1], rate) if frequency_hz is None else frequency_hz, rate)
    factor = factors(lines, rate, resample)
    flat = records.reshape(-1, records.shape[-1])
    responses = np.empty((6, len(flat), lines.size))
    for times in np.unique(factor):  # an octave of lines each, so that only the highest pay for the highest rate
        block = factor == times
        theta = 2 * np.pi * lines[block] / (rate * times)
        responses[..., block] = _largest(upsampled(flat, int(times)), theta, zeta, threads)
    peaks = _Peaks(*responses.reshape(6, *records.shape[:-1], lines.size))
    return peaks.spectrum(lines, zeta, sampling_error(lines, np.asarray(rate * factor, dtype=np.float64)))


def sampling_error(frequency_hz: Floats, sampling_rate_hz: float | Floats) -> Floats:
    """The share of a peak, at most, that a line of a sampled record may lose: 1 - cos(x) (sin(x) / x)^2, x = pi f / fs.

    cos(x): between samples a ringing at f goes on by x at most until its peak. (sin(x) / x)^2: what is left of content
    at f where straight lines join the samples. The documentation of `pyyeti.srs` adds up the same two losses. It holds
    for responses that ring at their own line and for records without content from half the sampling rate upwards, as
    an analogue filter makes them; what was folded into a record when it was taken no one can tell from it.
    """
    x = np.pi * frequency_hz / sampling_rate_hz
    return np.asarray(1 - np.cos(x) * np.sinc(x / np.pi) ** 2)


@dataclass(frozen=True, eq=False)
class _Peaks:
    """Largest responses of either sign, >= 0, while the record lasts and after it; p is omega^2 times displacement."""

    up: Floats
    down: Floats
    p: Floats
    up_after: Floats
    down_after: Floats
    p_after: Floats

    def spectrum(self, lines: Floats, zeta: float, error: Floats) -> Spectrum:
        primary, residual = np.maximum(self.up, self.down), np.maximum(self.up_after, self.down_after)
        return Spectrum(
            frequency_hz=lines,
            damping_ratio=zeta,
            maximax=np.maximum(primary, residual),
            positive=np.maximum(self.up, self.up_after),
            negative=np.maximum(self.down, self.down_after),
            primary=primary,
            residual=residual,
            pseudo_velocity_m_s=np.maximum(self.p, self.p_after) / (2 * np.pi * lines),
            sampling_error=error,
        )


def _largest(records: Floats, theta: Floats, zeta: float, threads: int | None) -> Floats:
    """The fields of `_Peaks`, (6, k, f). After the record p' = v and v' = -p - 2 zeta v."""
    from .kernel import run

    highest, lowest, furthest, p, v = run(records, steps(theta, zeta), threads)
    x = p + 2 * zeta * v
    up, down = coefficients.extremes(x, v - 2 * zeta * x, zeta)
    p_up, p_down = coefficients.extremes(p, v, zeta)
    return np.stack([highest, -lowest, furthest, np.maximum(up, 0), np.maximum(-down, 0), np.maximum(p_up, -p_down)])


@dataclass(frozen=True, eq=False)
class Response:
    """At each sample of the record, (n,): what the mass feels, and how far it is from its place on the base."""

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
    """Of one record (n,), m/s2, from rest. Q is 10 by default. Raises `ValueError` as a spectrum does."""
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
