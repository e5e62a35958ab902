"""Figures of one shock in an acceleration record: peak, durations, velocity change, and a summary
of its spectrum.

Pulse duration: between the crossings of a tenth of the peak on either side of it, as MIL-STD-810
and IEC 60068-2-27 read classical pulses. Effective duration: the least length of time that holds
every excursion beyond a third of the peak (MIL-STD-810, method 516). Energy duration: from 5 to 95
% of the energy (Trifunac and Brady, BSSA 65 (1975) 581). Velocity change: the integral over the
pulse, from where it leaves the rest to where it is back, within the 0.4 durations before and 0.1
durations after it over which IEC 60068-2-27 integrates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..array_types import Floats
from .record_rest import rest_before_shock
from .srs.spectrum import SAMPLES_PER_CYCLE

#: Share of the peak between whose crossings a pulse lasts, and that of the effective duration.
PULSE_SHARE, EFFECTIVE_SHARE = 0.1, 1 / 3
#: IEC 60068-2-27: the velocity change is integrated from so many durations before the pulse to so
#: many after it.
BEFORE_PULSE, AFTER_PULSE = 0.4, 0.1
#: Energy that lies before and after the energy duration.
ENERGY_TAIL = 0.05
#: The spectrum's summary: octaves from here up, Q = 10.
LOWEST_LINE_HZ, SRS_Q = 10.0, 10.0
#: A long record is searched in blocks of so many samples.
_BLOCK = 4096
#: Low lines are those of which means of so many samples have so many to a cycle: that loses some
#: 0.5 % of them.
_MEANS, _SAMPLES_OF_LOW = 8, 40
#: Second differences of this share of the peak are those of twelve samples a cycle, of which
#: straight lines lose 2 %.
_FAST_SHARE = 0.27
#: What high lines need not see: below a share of the peak that Q = 10 cannot make more than 3 % of
#: it, or the noise.
_SILENT_SHARE, _SILENT_SIGMAS = 0.003, 6.0


@dataclass(frozen=True)
class ShockFigures:
    """Accelerations in m/s2 above the rest before the shock, times in seconds on the record's
    clock.

    `rest_m_s2` is None where the record holds no rest before the shock; zero is then as recorded.
    `pulse_start_s` is the first crossing of a tenth of the peak. `record_velocity_change_m_s` is
    the integral over the whole record: what a zero shift and the rebound add shows there. The
    spectrum (maximax, Q = 10) has a line an octave from 10 Hz, as far as the record holds a period
    and ten samples of it; None for the largest where it has no line.
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


def shock_figures(
    acceleration: Floats, sampling_rate_hz: float, start_s: float = 0.0
) -> ShockFigures | None:
    """Figures of a record that holds one shock; None where it never moves, or holds fewer than two
    numbers.

    Parameters:
        acceleration: The record (n,) in m/s2. Samples that are no numbers count as rest.
        sampling_rate_hz: Its sampling rate.
        start_s: The time of its first sample on the clock on which the figures state times; by
            default 0.
    """
    if acceleration.size < 2:
        return None
    if np.isfinite(acceleration.sum()):
        rest, noise = rest_before_shock(acceleration)
        x = acceleration - (rest or 0.0)
    else:
        finite = np.isfinite(acceleration)
        if np.count_nonzero(finite) < 2:
            return None
        rest, noise = rest_before_shock(acceleration[finite])
        x = np.where(finite, acceleration - (rest or 0.0), 0.0)
    highest, lowest = int(x.argmax()), int(x.argmin())
    top = highest if x[highest] >= -x[lowest] else lowest
    peak = abs(float(x[top]))
    if x[highest] == x[lowest]:
        return None
    period = 1 / sampling_rate_hz
    sign = 1.0 if x[top] > 0 else -1.0
    first, last = _crossings(x, top, sign, PULSE_SHARE * peak)
    lines, maximax = _spectrum(
        x, sampling_rate_hz, max(_SILENT_SHARE * peak, _SILENT_SIGMAS * noise)
    )
    largest = int(np.argmax(maximax)) if lines else None
    return ShockFigures(
        rest_m_s2=rest,
        peak_acceleration_m_s2=peak,
        signed_peak_acceleration_m_s2=float(x[top]),
        peak_time_s=start_s + top * period,
        pulse_start_s=start_s + first * period,
        pulse_duration_s=(last - first) * period,
        effective_duration_s=_effective_samples(x, EFFECTIVE_SHARE * peak) * period,
        energy_duration_s=_energy_samples(x) * period,
        velocity_change_m_s=_pulse_integral(x, top, sign, first, last) * period,
        record_velocity_change_m_s=(float(x.sum()) - 0.5 * float(x[0] + x[-1])) * period,
        srs_frequency_hz=lines,
        srs_maximax_m_s2=maximax,
        srs_peak_m_s2=None if largest is None else maximax[largest],
        srs_peak_frequency_hz=None if largest is None else lines[largest],
    )


def summary_lines(samples: int, sampling_rate_hz: float) -> tuple[float, ...]:
    """Octaves from 10 Hz, in Hz, of which a record holds a period and, in each, ten samples.

    Parameters:
        samples: The number of samples in the record.
        sampling_rate_hz: Its sampling rate.
    """
    low, high = sampling_rate_hz / samples, sampling_rate_hz / SAMPLES_PER_CYCLE
    octaves = max(0, int(np.floor(np.log2(high / LOWEST_LINE_HZ) + 1e-9)) + 1) if high > 0 else 0
    return tuple(line for line in (LOWEST_LINE_HZ * 2.0**i for i in range(octaves)) if line >= low)


def _crossings(x: Floats, top: int, sign: float, level: float) -> tuple[float, float]:
    """Where `sign` times `x` falls to `level` on either side of its peak, in fractional samples;
    else the record's ends."""
    right = _fall(x[top:], sign, level)
    start = _fall(x[: top + 1][::-1], sign, level)
    return (0.0 if start is None else top - start), (
        float(x.size - 1) if right is None else top + right
    )


def _fall(x: Floats, sign: float, level: float) -> float | None:
    """Where `sign` times `x` falls to `level`, counted from the first sample."""
    for begin in range(0, x.size, _BLOCK):
        below = sign * x[begin : begin + _BLOCK] <= level
        if below.any():
            i = begin + int(below.argmax())
            return 0.0 if i == 0 else _between(sign * x[i - 1], sign * x[i], i - 1, level)
    return None


def _between(before: float, after: float, i: int, level: float) -> float:
    """Where a line from `before` at sample `i` to `after` at the next one has `level`."""
    return i + float((level - before) / (after - before)) if after != before else float(i)


def _effective_samples(x: Floats, level: float) -> float:
    beyond = (x > level) | (x < -level)
    first, last = int(beyond.argmax()), x.size - 1 - int(beyond[::-1].argmax())
    begin = _between(abs(x[first - 1]), abs(x[first]), first - 1, level) if first > 0 else 0.0
    end = (
        _between(abs(x[last]), abs(x[last + 1]), last, level) if last < x.size - 1 else float(last)
    )
    return end - begin


def _energy_samples(x: Floats) -> float:
    """Between the shares of the energy, by the trapezoid rule: in blocks first, then within the two
    that hold them."""
    size = (x.size - 1) // _BLOCK * _BLOCK
    blocks = x[:size].reshape(-1, _BLOCK)
    edges = x[: size + 1 : _BLOCK] ** 2
    sums = np.einsum("ij,ij->i", blocks, blocks) + np.diff(edges) / 2
    rest = x[size:]
    last = float(rest @ rest) - 0.5 * float(rest[0] ** 2 + rest[-1] ** 2)
    grown = np.concatenate(([0.0], np.cumsum(np.append(sums, last))))
    if not grown[-1] > 0:  # so small that its square is zero
        return 0.0
    return _reached(x, grown, 1 - ENERGY_TAIL) - _reached(x, grown, ENERGY_TAIL)


def _reached(x: Floats, grown: Floats, share: float) -> float:
    """The first time, in samples, at which a share of the energy has come; linear between
    samples."""
    level = share * float(grown[-1])
    block = max(0, int(np.searchsorted(grown, level)) - 1)
    piece = x[block * _BLOCK : (block + 1) * _BLOCK + 1] ** 2
    within = grown[block] + np.concatenate(([0.0], np.cumsum(piece[1:] + piece[:-1]) / 2))
    i = min(int(np.searchsorted(within, level)), within.size - 1)
    before = float(within[i - 1]) if i else float(within[0])
    step = float(within[i]) - before
    return block * _BLOCK + (i - 1 + (level - before) / step if i and step > 0 else float(i))


def _pulse_integral(x: Floats, top: int, sign: float, first: float, last: float) -> float:
    """Integral of `x` over its pulse, in samples times m/s2."""
    leaves, returns = _crossings(x, top, sign, 0.0)
    begin = max(leaves, first - BEFORE_PULSE * (last - first), 0.0)
    end = min(returns, last + AFTER_PULSE * (last - first), float(x.size - 1))
    low = int(begin)
    at = np.concatenate(([begin], np.arange(low + 1, np.ceil(end)), [end]))
    piece = x[low : int(np.ceil(end)) + 1]
    return float(np.trapezoid(np.interp(at, low + np.arange(piece.size), piece), at))


def _spectrum(
    x: Floats, sampling_rate_hz: float, silent: float
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Lines and maximax. Low lines see the whole record in means of `_MEANS` samples, high ones its
    part that is above `silent`: within a percent of the whole record's spectrum, at a tenth of the
    time."""
    lines = summary_lines(x.size, sampling_rate_hz)
    if not lines:
        return (), ()
    from .srs.spectrum import RESAMPLED_WITHIN, shock_response_spectrum

    rate = sampling_rate_hz / _MEANS
    low = [line for line in lines if line * _SAMPLES_OF_LOW <= rate]
    maximax: list[float] = []
    if low:
        whole = x.size // _MEANS * _MEANS
        means = np.append(
            x[:whole].reshape(-1, _MEANS) @ np.full(_MEANS, 1 / _MEANS), x[whole:].sum() / _MEANS
        )
        of_means = shock_response_spectrum(
            means, rate, low, q=SRS_Q, resample_within=None, threads=1
        )
        maximax += of_means.maximax.tolist()
    if high := lines[len(low) :]:
        heard = (x > silent) | (x < -silent)
        first, last = int(heard.argmax()), x.size - 1 - int(heard[::-1].argmax())
        part = x[max(0, first - _MEANS) : last + 1 + _MEANS]
        second = float(np.abs(np.diff(part, 2)).max(initial=0.0))
        within = RESAMPLED_WITHIN if second > _FAST_SHARE * float(np.abs(part).max()) else None
        spectrum = shock_response_spectrum(
            part, sampling_rate_hz, high, q=SRS_Q, resample_within=within, threads=1
        )
        maximax += spectrum.maximax.tolist()
    return lines, tuple(maximax)
