"""What a gun's recording says of the shot: muzzle velocity from the laser, tank pressure before the valve opened, and,
for recordings that no trigger began, when it opened, from the drop of the pressure alone."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from ..signals.channel import Channel
from ..signals.checks.base import Finding
from .velocity import NoDropError, NoPassageError, muzzle_velocity, tank_pressure_before

#: Means over this time are what is fitted: shorter ones are not independent behind a transducer of some 1 kHz.
_BLOCK_S, _MOST_BLOCKS = 1e-3, 250
#: The fit ends where the pressure has fallen by so many deviations of a block's noise, or by the first share of its
#: fall where that is more, and by the second one at most.
_DEPTH, _LEAST_DEPTH, _MOST_DEPTH = 60.0, 0.005, 0.5
#: Blocks so many deviations below the level show the drop; a shot is expected to exceed twice that.
_SEEN = 4.0
#: From an opening at once (the gas drives the projectile away) to one whose area itself grows with the square of time.
_POWERS = np.arange(0.5, 4.01, 0.25)
#: Of the time from the opening to the end of the fit: a standard uncertainty of the law's form, by the virtual gun.
_FORM_SHARE = 1 / 30
_FEWEST_BLOCKS, _LEAST_REST = 12, 5


@dataclass(frozen=True)
class ValveOpening:
    """The moment at which the port begins to open, in seconds from the record's first sample, and when the drop shows.

    `time_u_s` is a standard uncertainty: of the noise, of the power law's exponent, and of the law itself. The drop
    exceeds the noise at `seen_s`; `power` is the mean exponent.
    """

    time_s: float
    time_u_s: float
    seen_s: float
    power: float


def valve_opening(pressure_pa: NDArray[Any], sampling_rate_hz: float) -> ValveOpening:
    """The onset of the drop in a record of tank pressure (n,), Pa.

    The level and a power of time are fitted together, p = p0 for t <= t0 and p0 - a (t - t0)^k after it: while the port
    opens, its area grows with a power of time (1 for a sharp edge, 3/2 for two circles), and the gas that has left with
    one more. The moment is the mean over all t0 and k, weighted by their likelihood: what the noise hides of the drop's
    beginning is extrapolated by what follows. Raises `NoDropError` where the pressure does not fall by more than the
    noise, or falls from the record's first blocks on; `ValueError` for a sample that is not finite.
    """
    values = np.asarray(pressure_pa, dtype=np.float64)
    if not np.all(np.isfinite(values)):
        raise ValueError(f"pressure: sample {int(np.argmin(np.isfinite(values)))} is not finite")
    block = max(1, round(_BLOCK_S * sampling_rate_hz))
    count = values.size // block
    if count < _FEWEST_BLOCKS:
        raise NoDropError(f"{values.size} samples of pressure: expected at least {_FEWEST_BLOCKS * block}")
    means = np.asarray(values[: count * block].reshape(count, block).mean(axis=1), dtype=np.float64)
    step = np.unique(values[:1000])
    smallest = float(np.diff(step).min()) / math.sqrt(12 * block) if step.size > 1 else 1e-9 * abs(values[0]) + 1e-9
    # Of second differences, which the slope of the drop leaves alone.
    noise = max(float(np.median(np.abs(np.diff(means, 2)))) * 1.4826 / math.sqrt(6), smallest)
    stop, level = _end_of_fit(means, noise)
    first = max(0, stop - _MOST_BLOCKS)
    time = (np.arange(first, stop) + 0.5) * block / sampling_rate_hz
    return _fitted(time.astype(np.float64), means[first:stop], noise, level, block / sampling_rate_hz)


def _end_of_fit(means: Floats, noise: float) -> tuple[int, float]:
    """Number of blocks up to the end of the fit, and the level before the drop."""
    level = float(np.median(means[: max(3, means.size // 20)]))
    fall = level - float(means.min())
    if not fall > 2 * _SEEN * noise:
        raise NoDropError(
            f"no drop: pressure falls by {fall:.3g} Pa, with noise of {noise:.3g} Pa in {_BLOCK_S * 1e3:g} ms; a shot "
            f"is expected to exceed {2 * _SEEN:g} times the noise"
        )
    depth = min(max(_DEPTH * noise, _LEAST_DEPTH * fall), _MOST_DEPTH * fall)
    return int(np.argmax(means <= level - depth)) + 1, level


def _fitted(time: Floats, means: Floats, noise: float, level: float, block_s: float) -> ValveOpening:
    onset = np.linspace(time[0], time[-1], 2 * time.size)
    least = np.empty((_POWERS.size, onset.size))
    after = np.maximum(time - onset[:, None], 0.0)
    apart = means - means.mean()
    for row, power in zip(least, _POWERS, strict=True):
        law = after**power
        law -= law.mean(axis=1, keepdims=True)
        spread = np.einsum("ij,ij->i", law, law)
        slope = np.minimum(law @ apart, 0.0)  # the pressure falls
        row[:] = apart @ apart - np.divide(slope**2, spread, out=np.zeros_like(spread), where=spread > 0)
    variance = max(noise**2, float(least.min()) / max(time.size - 4, 1))
    weight = np.exp(-(least - least.min()) / (2 * variance))
    weight /= weight.sum()
    moments, powers = weight.sum(axis=0), weight.sum(axis=1)
    moment = float(moments @ onset)
    scatter = math.sqrt(float(moments @ (onset - moment) ** 2))
    above = np.flatnonzero(means >= level - _SEEN * noise)
    seen = float(time[min(above[-1] + 1 if above.size else 0, time.size - 1)])
    if moment < _LEAST_REST * block_s:
        raise NoDropError(
            f"the pressure falls from {1e3 * moment:.2g} ms after the record's beginning on: expected "
            f"{1e3 * _LEAST_REST * block_s:g} ms of rest at least"
        )
    form = _FORM_SHARE * float(time[-1] - moment)
    total = math.sqrt(scatter**2 + form**2 + block_s**2 / 12)
    return ValveOpening(moment, total, seen, float(powers @ _POWERS))


#: Where a laser across the barrel stands in campaign.toml's `position`; a channel named laser… is one too.
MUZZLE_POSITIONS = ("muzzle", "barrel")


@dataclass(frozen=True)
class ShotMeasurement:
    """Measured values with their standard uncertainties; None where the channel is missing or tells nothing."""

    velocity_m_s: float | None = None
    velocity_u_m_s: float | None = None
    tank_pressure_pa: float | None = None
    tank_pressure_u_pa: float | None = None
    valve_opening: ValveOpening | None = None


def laser_channel(channels: list[Channel]) -> Channel | None:
    """The channel that sees the bullet pass: a displacement or voltage at the muzzle, or one named laser…"""
    for channel in channels:
        at_muzzle = (channel.sensor.position or "").lower() in MUZZLE_POSITIONS
        if channel.quantity in ("displacement", "voltage") and (at_muzzle or channel.name.lower().startswith("laser")):
            return channel
    return None


def measure_shot(
    channels: list[Channel], bullet_length_m: float | None, bullet_length_u_m: float | None
) -> tuple[ShotMeasurement | None, list[Finding]]:
    """Velocity (eq. 5.2) and pressure of a shot, and findings where a channel is there but says nothing usable."""
    velocity, problems = _velocity(laser_channel(channels), bullet_length_m, bullet_length_u_m)
    tank = next((c for c in channels if c.quantity == "pressure"), None)
    pressure, more = _pressure(tank)
    if velocity == (None, None) and pressure == (None, None):
        return None, problems + more
    return ShotMeasurement(*velocity, *pressure, _opening(tank)), problems + more


Pair = tuple[float | None, float | None]


def _velocity(laser: Channel | None, length: float | None, length_u: float | None) -> tuple[Pair, list[Finding]]:
    if laser is None:
        return (None, None), []
    if length is None:
        message = "no velocity from the laser: runs.csv gives no bullet_length_mm for this shot"
        return (None, None), [Finding("no-bullet-length", "warning", message, laser.name)]
    given = {} if length_u is None else {"length_u_m": length_u}
    try:
        opening = muzzle_velocity(laser.readings, laser.sampling_rate_hz, length, **given)
    except (NoPassageError, ValueError) as error:
        return (None, None), [Finding("no-passage", "warning", str(error), laser.name)]
    return (opening.velocity_m_s, opening.velocity_u_m_s), []


def _pressure(channel: Channel | None) -> tuple[Pair, list[Finding]]:
    if channel is None:
        return (None, None), []
    try:
        opening = tank_pressure_before(channel.readings)
    except (NoDropError, ValueError) as error:
        return (None, None), [Finding("no-pressure-drop", "note", str(error), channel.name)]
    # The calibration is common to all shots, and is not averaged out by them.
    common_u = channel.sensor.calibration_u_si(opening.pressure_pa)
    return (opening.pressure_pa, math.hypot(opening.pressure_u_pa, common_u)), []


def _opening(channel: Channel | None) -> ValveOpening | None:
    """On the recording's clock; None where the record does not show it, which `no-pressure-drop` says already."""
    if channel is None:
        return None
    try:
        opening = valve_opening(channel.readings, channel.sampling_rate_hz)
    except (NoDropError, ValueError):
        return None
    return replace(opening, time_s=channel.start_s + opening.time_s, seen_s=channel.start_s + opening.seen_s)
