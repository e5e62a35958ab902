"""Figures of one shock in an acceleration record: peak, durations, velocity change, and a summary of its spectrum.

Pulse duration: between the crossings of a tenth of the peak on either side of it, as MIL-STD-810 and IEC 60068-2-27
read classical pulses. Effective duration: the least length of time that holds every excursion beyond a third of the
peak (MIL-STD-810, method 516). Energy duration: from 5 to 95 % of the energy (Trifunac and Brady, BSSA 65 (1975) 581).
Velocity change: the integral over the pulse, from where it leaves the rest to where it is back, within the 0.4
durations before and 0.1 durations after it over which IEC 60068-2-27 integrates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .srs.grid import SAMPLES_PER_CYCLE

Floats = NDArray[np.float64]

#: Share of the peak between whose crossings a pulse lasts, and that of the effective duration.
PULSE_SHARE, EFFECTIVE_SHARE = 0.1, 1 / 3
#: IEC 60068-2-27: the velocity change is integrated from so many durations before the pulse to so many after it.
BEFORE_PULSE, AFTER_PULSE = 0.4, 0.1
#: Energy that lies before and after the energy duration.
ENERGY_TAIL = 0.05
#: The spectrum's summary: octaves from here up, Q = 10.
LOWEST_LINE_HZ, SRS_Q = 10.0, 10.0
#: Below this share of the peak a record counts as at rest, unless its noise is larger (as in the checks of a record).
_REST_SHARE, _NOISE_SIGMAS, _NOISE_SAMPLES = 0.05, 5.0, 32
_MAD_TO_SIGMA = 1.4826
#: Fewer samples give no level.
_MIN_REST_SAMPLES = 16


@dataclass(frozen=True)
class ShockFigures:
    """Accelerations in m/s2 above the rest before the shock, times in seconds on the record's clock.

    `rest_m_s2` is None where the record holds no rest before the shock; zero is then as recorded.
    `pulse_start_s` is the first crossing of a tenth of the peak. `record_velocity_change_m_s` is the integral over the
    whole record: what a zero shift and the rebound add shows there. The spectrum (maximax, Q = 10) has a line an octave
    from 10 Hz, as far as the record holds a period and ten samples of it; None for the largest where it has no line.
    """

    rest_m_s2: float | None
    peak_acceleration_m_s2: float
    signed_peak_acceleration_m_s2: float
    peak_time_s: float
    pulse_start_s: float
    pulse_duration_s: float
    effective_duration_s: float
    energy_duration_s: float
    velocity_change_m_s: float
    record_velocity_change_m_s: float
    srs_frequency_hz: tuple[float, ...]
    srs_maximax_m_s2: tuple[float, ...]
    srs_peak_m_s2: float | None
    srs_peak_frequency_hz: float | None


def shock_figures(acceleration: Floats, sampling_rate_hz: float, start_s: float = 0.0) -> ShockFigures | None:
    """Of a record (n,) in m/s2 that holds one shock; None where it never moves, or holds fewer than two numbers.

    Samples that are no numbers count as rest.
    """
    finite = np.isfinite(acceleration)
    if np.count_nonzero(finite) < 2:
        return None
    rest = _rest_before(acceleration[finite])
    x = acceleration - (rest or 0.0)
    if not finite.all():
        x = np.where(finite, x, 0.0)
    size = np.abs(x)
    top = int(size.argmax())
    peak = float(size[top])
    if peak == 0.0 or float(np.ptp(x)) == 0.0:
        return None
    period = 1 / sampling_rate_hz
    upright = x if x[top] > 0 else -x
    first, last = _crossings(upright, top, PULSE_SHARE * peak)
    lines, maximax = _spectrum(x, sampling_rate_hz)
    largest = int(np.argmax(maximax)) if lines else None
    return ShockFigures(
        rest_m_s2=rest,
        peak_acceleration_m_s2=peak,
        signed_peak_acceleration_m_s2=float(x[top]),
        peak_time_s=start_s + top * period,
        pulse_start_s=start_s + first * period,
        pulse_duration_s=(last - first) * period,
        effective_duration_s=_effective_samples(size, peak) * period,
        energy_duration_s=_energy_samples(x / peak) * period,
        velocity_change_m_s=_pulse_integral(x, upright, top, first, last) * period,
        record_velocity_change_m_s=float(np.trapezoid(x, dx=period)),
        srs_frequency_hz=lines,
        srs_maximax_m_s2=maximax,
        srs_peak_m_s2=None if largest is None else maximax[largest],
        srs_peak_frequency_hz=None if largest is None else lines[largest],
    )


def summary_lines(samples: int, sampling_rate_hz: float) -> tuple[float, ...]:
    """Octaves from 10 Hz of which a record holds a period and, in each, ten samples."""
    low, high = sampling_rate_hz / samples, sampling_rate_hz / SAMPLES_PER_CYCLE
    octaves = max(0, int(np.floor(np.log2(high / LOWEST_LINE_HZ) + 1e-9)) + 1) if high > 0 else 0
    return tuple(line for line in (LOWEST_LINE_HZ * 2.0**i for i in range(octaves)) if line >= low)


def _rest_before(x: Floats) -> float | None:
    """Mean of the first half of what lies before the shock: the second may hold the foot of a slow pulse."""
    begin = x[:_NOISE_SAMPLES]
    level = float(np.median(begin[:_MIN_REST_SAMPLES]))
    away = np.abs(x - level)
    peak = float(away.max())
    steps = np.diff(begin)
    sigma = _MAD_TO_SIGMA * float(np.median(np.abs(steps - np.median(steps)))) / 2**0.5
    loud = min(max(_REST_SHARE * peak, _NOISE_SIGMAS * sigma), 0.5 * peak)
    onset = int(np.argmax(away > loud)) if peak > 0 else 0
    quiet = x[: onset // 2]
    return float(quiet.mean()) if quiet.size >= _MIN_REST_SAMPLES else None


def _crossings(upright: Floats, top: int, level: float) -> tuple[float, float]:
    """Where `upright` falls to `level` on either side of its peak, in fractional samples; else the record's ends."""
    left = np.flatnonzero(upright[:top] <= level)
    right = np.flatnonzero(upright[top:] <= level)
    first = _between(upright, int(left[-1]), level) if left.size else 0.0
    last = _between(upright, top + int(right[0]) - 1, level) if right.size else float(upright.size - 1)
    return first, last


def _between(x: Floats, i: int, level: float) -> float:
    rise = float(x[i + 1] - x[i])
    return i + (level - float(x[i])) / rise if rise else float(i)


def _effective_samples(size: Floats, peak: float) -> float:
    level = EFFECTIVE_SHARE * peak
    beyond = np.flatnonzero(size > level)
    first, last = int(beyond[0]), int(beyond[-1])
    begin = _between(size, first - 1, level) if first > 0 else 0.0
    end = _between(size, last, level) if last < size.size - 1 else float(last)
    return end - begin


def _energy_samples(x: Floats) -> float:
    power = x * x
    grown = np.cumsum(power[1:] + power[:-1])
    return _reached(grown, 1 - ENERGY_TAIL) - _reached(grown, ENERGY_TAIL)


def _reached(grown: Floats, share: float) -> float:
    """Where a sum that starts from 0 a sample earlier first reaches a share of its end, linear between samples."""
    level = share * float(grown[-1])
    i = int(np.searchsorted(grown, level))
    before = float(grown[i - 1]) if i else 0.0
    return i + (level - before) / (float(grown[i]) - before)


def _pulse_integral(x: Floats, upright: Floats, top: int, first: float, last: float) -> float:
    """Integral of `x` over its pulse, in samples times m/s2."""
    leaves, returns = _crossings(upright, top, 0.0)
    begin = max(leaves, first - BEFORE_PULSE * (last - first), 0.0)
    end = min(returns, last + AFTER_PULSE * (last - first), float(x.size - 1))
    inner = np.arange(np.floor(begin) + 1, np.ceil(end))
    at = np.concatenate(([begin], inner, [end]))
    return float(np.trapezoid(_sampled(x, at), at))


def _sampled(x: Floats, at: Floats) -> Floats:
    """Linear interpolation about a few points of a long record."""
    low, high = int(at[0]), min(int(at[-1]) + 2, x.size)
    return np.asarray(np.interp(at, np.arange(low, high), x[low:high]))


def _spectrum(x: Floats, sampling_rate_hz: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    lines = summary_lines(x.size, sampling_rate_hz)
    if not lines:
        return (), ()
    from .srs.spectrum import shock_response_spectrum

    found = shock_response_spectrum(x, sampling_rate_hz, lines, q=SRS_Q, threads=1)
    return lines, tuple(float(value) for value in found.maximax)
