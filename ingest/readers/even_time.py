"""Whether the times of samples are even, and the sampling rate that they give.

Times are even where the standard deviation of their steps is at most `MAX_STEP_DEVIATION` of the
mean step, no step departs by more than `MAX_LONE_DEVIATION` (the joints of blocks of a recorder
do), and the rate within the record stays within `MAX_RATE_DRIFT`; all beyond what the last printed
digit, the float or the counter hides. Steps of several samples are gaps and are handed on as such.
Anything else is refused, as two rates, drift or jitter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .base import RecordingError, rate_from_step

#: Standard deviation of the steps, of the mean step. It moves a wave at a tenth of the rate by 0.6
#: % of its peak.
MAX_STEP_DEVIATION = 0.01
#: One step from the mean step. Recorders that write blocks with a time each count it in coarse
#: ticks.
MAX_LONE_DEVIATION = 0.35
#: From the slowest to the fastest part of a record: lines of a spectrum move by as much in
#: frequency.
MAX_RATE_DRIFT = 0.01
#: A step longer than this is a gap, not a step ...
GAP_STEPS = 1.5
#: ... if at most this share of the steps is as long.
MAX_GAP_SHARE = 0.1
#: Steps that differ by less than this share are even whatever hides them.
_ALIKE = 1e-3
#: Times of a sample of a record by which its last digit is told.
_PROBED = 512
#: Fewer numbers than these can have a short last digit by chance.
_FEWEST = 8
CURE = (
    'save the record evenly sampled, or write uneven_time = "resample" under [recordings] of '
    "campaign.toml (--uneven-time resample of a command)"
)


class UnevenTimeError(RecordingError):
    """The steps of a record differ by more than its digits explain."""


@dataclass(frozen=True)
class EvenTime:
    """Rate and start of even times; `gaps` are [sample, missing samples before it]."""

    rate_hz: float
    start_s: float
    gaps: list[list[int]]


def even_time(path: Path, times: NDArray[np.float64], unit_s: float = 1.0) -> EvenTime:
    """Of times (n,), n >= 2, as the file has them, in units of `unit_s` seconds.

    The rate is the inverse of the mean step outside gaps, rounded as far as the printed digits
    leave open, so that a column printed to the microsecond gives 51200 and not 51199.7 (its median
    step would give 50000). Raises `RecordingError` when time does not increase or a step is not
    finite, `UnevenTimeError` where times are uneven; gaps (rare steps of several samples) are left
    for the quality check.
    """
    if times.size < 2:
        raise RecordingError(
            f"{path.name}: a time column needs at least two samples, got {times.size}"
        )
    steps = np.diff(times)
    refuse_no_increase(path, times, steps, unit_s)
    shortest, longest = float(steps.min()), float(steps.max())
    if longest - shortest <= _ALIKE * shortest:
        return _even(times, steps, longest - shortest, unit_s)
    quantum = time_quantum(times, steps)
    digit = quantum.total
    typical = float(np.mean(steps[steps <= 2.5 * np.median(steps)]))
    longest = GAP_STEPS * typical + (digit if digit < typical else 0.0)
    in_sequence = steps < longest
    even = steps[in_sequence]
    if even.size < (1.0 - MAX_GAP_SHARE) * steps.size or not _is_even(even, quantum):
        raise UnevenTimeError(f"{path.name}: {_description(times, unit_s, quantum)}; {CURE}")
    regular = _even(times, even, float(even.max() - even.min()), unit_s)
    after = np.flatnonzero(~in_sequence)
    missing = [max(1, round(float(steps[i]) * unit_s * regular.rate_hz) - 1) for i in after]
    return replace(
        regular, gaps=[[int(i) + 1, count] for i, count in zip(after, missing, strict=True)]
    )


def _even(times: Floats, steps: Floats, spread: float, unit_s: float) -> EvenTime:
    """Of even `steps` (n,), which differ by `spread` at most."""
    step = float(np.mean(steps))
    printed = 2.0 * spread / (steps.size * step)
    rate_hz = rate_from_step(step * unit_s, min(max(printed, 1e-6), 5e-5))
    return EvenTime(rate_hz, float(times[0]) * unit_s, [])


def refuse_no_increase(path: Path, times: Floats, steps: Floats, unit_s: float) -> None:
    """Raise `RecordingError` with the first time that is not finite or not above the one before
    it."""
    if not np.all(np.isfinite(steps)) or np.any(steps <= 0):
        row = int(np.argmin(np.where(np.isfinite(steps), steps, -np.inf))) + 1
        raise RecordingError(
            f"{path.name}: time does not increase at sample {row} (t = {times[row] * unit_s} s)"
        )


@dataclass(frozen=True)
class Quantum:
    """To what times are rounded: the last `digit` of a decimal or a counter, and the `noise` of a
    float."""

    digit: float
    noise: float

    @property
    def total(self) -> float:
        return self.digit + self.noise

    def step_variance(self, mean: float) -> float:
        """Of the steps of even times of step `mean` that are rounded: they have two lengths, a
        digit apart."""
        share = mean / self.digit % 1.0 if self.digit > 0.0 else 0.0
        return self.digit**2 * share * (1.0 - share) + self.noise**2 / 4.0


def time_quantum(times: Floats, steps: Floats) -> Quantum:
    """To what rising times (n,) are rounded; `steps` are their differences."""
    largest = float(max(abs(times[0]), abs(times[-1])))
    probe = times[np.unique(np.linspace(0, times.size - 1, _PROBED).astype(np.intp))]
    floor = 2.0 * float(np.spacing(largest))
    if np.array_equal(probe.astype(np.float32), probe):
        floor = float(np.spacing(np.float32(largest)))
    return Quantum(max(_decimal_quantum(times, steps), _tick(times, steps)), floor)


def _decimal_quantum(times: Floats, steps: Floats) -> float:
    """The last decimal digit where it is coarsest: of the largest times, as numbers of six digits
    have it there."""
    decade = 10.0 ** np.floor(np.log10(max(abs(times[0]), abs(times[-1]))))
    shortest = float(np.min(steps))
    quantum = _decimals(_probe(times, decade), shortest)
    if np.count_nonzero(np.abs(times) >= decade) >= _FEWEST:
        return quantum
    return min(quantum, 10.0 * _decimals(_probe(times, decade / 10), shortest))


def _probe(times: Floats, least: float) -> Floats:
    """At most `_PROBED` of the times of at least so much."""
    rows = np.flatnonzero(np.abs(times) >= least)
    return times[rows[np.unique(np.linspace(0, rows.size - 1, _PROBED).astype(np.intp))]]


def _decimals(probe: Floats, shortest: float) -> float:
    """The largest power of ten, at most the shortest step, of which all are whole multiples; 0
    without one."""
    largest = float(np.max(np.abs(probe)))
    for digits in range(-int(np.floor(np.log10(1.001 * shortest))), 24):
        scaled = probe * 10.0**digits
        rounding = float(np.spacing(largest * 10.0**digits))
        if rounding > 0.25:
            return 0.0
        if np.all(np.abs(scaled - np.rint(scaled)) <= max(1e-3, rounding)):
            return float(10.0**-digits)
    return 0.0


def _tick(times: Floats, steps: Floats) -> float:
    """The period of a clock that counts: even times, each rounded to it, have steps of two lengths,
    whole multiples."""
    short = float(steps.min())
    near = steps[steps < 3.0 * short]
    tick = float(near.max()) - short
    noise = 4.0 * float(np.spacing(max(abs(times[0]), abs(times[-1]))))
    if tick <= 10.0 * noise or tick > 1.001 * short:
        return 0.0
    if tick > 0.6 * short and np.count_nonzero(near > short + tick / 2) < MAX_GAP_SHARE * near.size:
        return 0.0  # a few steps of two samples are gaps
    from_ends = np.minimum(near - short, short + tick - near)
    multiple = short / tick
    tolerance = 0.01 + noise / tick * (1.0 + multiple)
    return (
        tick
        if np.all(from_ends <= 0.01 * tick + noise) and abs(multiple - round(multiple)) <= tolerance
        else 0.0
    )


def _is_even(even: Floats, quantum: Quantum) -> bool:
    """Whether steps (n,) outside gaps are those of even times that are rounded to `quantum`."""
    mean = float(np.mean(even))
    deviation = even - mean
    if np.any(np.abs(deviation) > MAX_LONE_DEVIATION * mean + 1.01 * quantum.total):
        return False
    if np.mean(deviation**2) > (MAX_STEP_DEVIATION * mean) ** 2 + 1.1 * quantum.step_variance(mean):
        return False
    # A rate that moves evenly by MAX_RATE_DRIFT bends the times by an eighth of that, at its
    # middle.
    departure = np.cumsum(deviation)
    bend = float(max(departure.max(), 0.0) - min(departure.min(), 0.0))
    return (
        bend
        <= 2.02 * quantum.total + MAX_LONE_DEVIATION * mean + MAX_RATE_DRIFT / 8 * even.size * mean
    )


#: Parts of a record whose mean steps are compared.
_PARTS = 64
#: Of the bend of the whole record, what its halves may have left where it has two rates.
_STRAIGHT = 0.1


def _description(times: Floats, unit_s: float, quantum: Quantum) -> str:
    """How the steps of times are uneven: two rates, drift or jitter."""
    steps = np.diff(times)
    mean = float(np.mean(steps))
    range_text = f"from {steps.min() * unit_s:.6g} to {steps.max() * unit_s:.6g} s"
    at, bend = _bend(times)
    halves = (times[: at + 1], times[at:])
    if all(
        _within_even(half, quantum) and _bend(half)[1] <= _STRAIGHT * bend + quantum.total
        for half in halves
    ):
        before, after = ((half.size - 1) / (half[-1] - half[0]) / unit_s for half in halves)
        return (
            f"its time has two rates, {before:.6g} Hz up to sample {at} ({times[at] * unit_s:.6g} "
            f"s) and {after:.6g} Hz from there on"
        )
    spread = float(np.std(steps))
    parts = np.array([np.mean(part) for part in np.array_split(steps, min(_PARTS, steps.size))])
    scatter = float(np.sqrt(np.mean(np.diff(steps) ** 2) / 2))
    calm = scatter <= max(0.2 * spread, MAX_STEP_DEVIATION * mean + quantum.total)
    if calm and np.mean(np.diff(parts) ** 2) < 0.6 * np.var(parts):
        return (
            f"its time drifts: the step goes {range_text} (rate {1 / (parts.max() * unit_s):.6g} "
            f"to {1 / (parts.min() * unit_s):.6g} Hz) in {steps.size} steps"
        )
    return (
        f"its time has jitter: steps {range_text}, with a standard deviation of "
        f"{100 * spread / mean:.3g} % of the mean step of {mean * unit_s:.6g} s (at most "
        f"{100 * MAX_STEP_DEVIATION:g} % is taken as even)"
    )


def _bend(times: Floats) -> tuple[int, float]:
    """Where times (n,) are farthest from the straight line through their ends, and how far."""
    departure = np.abs(times - np.linspace(times[0], times[-1], times.size))
    at = int(np.argmax(departure))
    return min(max(at, 1), max(times.size - 2, 1)), float(departure.max())


def _within_even(times: Floats, quantum: Quantum) -> bool:
    steps = np.diff(times)
    return steps.size > 0 and _is_even(steps, quantum)
