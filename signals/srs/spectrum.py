"""Acceleration to shock response spectrum, after ISO 18431-4."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from . import free_decay
from .checked import checked_damping, checked_lines, checked_rate, checked_records
from .coefficients import steps
from .grid import grid_of_record
from .record import Spectrum
from .resample import factors, upsampled


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
    up, down = free_decay.extremes(x, v - 2 * zeta * x, zeta)
    p_up, p_down = free_decay.extremes(p, v, zeta)
    return np.stack([highest, -lowest, furthest, np.maximum(up, 0), np.maximum(-down, 0), np.maximum(p_up, -p_down)])
