"""Impact velocity of each hit from the impactor's own acceleration (thesis, section 4.1).

Only an accelerometer that rides on the impactor can tell: its `position` in campaign.toml says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...array_types import Floats
from ...signals.channel import Channel, Sensor, on_impactor
from ...signals.checks.base import Contact, Finding
from ..readers import RecordingError
from .common_grid import GridError, on_one_grid
from .deconvolution import clean_acceleration
from .pulses import ExtractedPulse
from .settings import ExtractionSettings
from .transfer_function import TransferFunctionError
from .velocity import impact_velocity


@dataclass(frozen=True)
class ImpactSpeed:
    """Impact velocity and its standard uncertainty (m/s), and its source
    (`schema.velocity_kinds`)."""

    velocity_m_s: float
    velocity_u_m_s: float
    source: str = "integrated"


@dataclass(frozen=True)
class StruckPlate:
    """What the motion of a plate's surface under a force follows from, SI; an `anvil` may lie on
    it."""

    youngs_modulus_pa: float
    poisson_ratio: float
    density_kg_m3: float
    thickness_m: float
    anvil: bool


#: A speed with the motion of the target's surface added, from the integrated one, the force
#: (points,) at equal phases of the contact and the plate. The law of that motion is physics, which
#: the ingest is given and does not know.
TargetMotion = Callable[[ImpactSpeed, Floats, StruckPlate], ImpactSpeed]


def impactor_channel(channels: list[Channel]) -> Channel | None:
    """The accelerometer on the impactor, if one was recorded.

    Parameters:
        channels: The channels of the recording; of several such ones the first is taken.
    """
    for channel in channels:
        if channel.quantity == "acceleration" and on_impactor(channel.sensor.position):
            return channel
    return None


def _earlier(contact: Contact, samples: int) -> Contact:
    return Contact(contact.first - samples, contact.peak - samples, contact.last - samples)


#: Samples before a contact that its window begins with: the rest that noise and zero are taken
#: from.
_BEFORE = 64
#: Longest window of a hit in seconds: a hammer head has rung down by then.
_LONGEST_WINDOW_S = 0.08


def impact_speeds(
    channels: list[Channel],
    pulses: tuple[ExtractedPulse, ...],
    settings: ExtractionSettings,
    contact_force: tuple[Floats, Channel] | None,
) -> tuple[tuple[ImpactSpeed | None, ...], list[Finding]]:
    """Velocity of each hit, and findings on the channel; no velocity where the impactor carries no
    accelerometer.

    With enough hits the acceleration is first freed of the hammer's own dynamics, each hit by the
    transfer function of the others. The delay behind the force is checked: the head's length is not
    part of a campaign, and its wave takes less than a sample (thesis: 12.4 of 19.5 µs), so the
    limit is two samples.

    Parameters:
        channels: The channels of the recording.
        pulses: The pulses of its contact force, in time order.
        settings: From how many hits on the hammer's dynamics are removed, and in which band it
            moves as one body.
        contact_force: The samples (n,) in N in which the pulses were found, and the channel on
            whose clock these are; None where there is no force.

    Returns:
        A velocity for each pulse, None where there is none, and the findings.

    Raises:
        RecordingError: For a sample beside a contact that is no number.

    Source:
        Thesis, eq. 4.1, for the delay.
    """
    channel = impactor_channel(channels)
    if channel is None or contact_force is None or not pulses:
        return (None,) * len(pulses), []
    force, clock = contact_force
    try:
        grid = on_one_grid([clock, channel])
    except GridError as error:
        message = f"no velocity from the impactor's acceleration: {error}"
        return (None,) * len(pulses), [
            Finding("no-impact-velocity", "warning", message, channel.name)
        ]
    samples = slice(grid.first, grid.first + grid.values.shape[1])
    force, acceleration = force[samples], grid.values[1]
    if pulses[0].contact.first < samples.start or pulses[-1].contact.last >= samples.stop:
        message = (
            f"no velocity from the impactor's acceleration: {channel.name!r} "
            f"is recorded from {grid.start_s:.6g} s on "
            f"for {force.size / grid.sampling_rate_hz:.6g} s only, in which not all contacts are"
        )
        return (None,) * len(pulses), [
            Finding("no-impact-velocity", "warning", message, channel.name)
        ]
    pulses = tuple(
        replace(pulse, contact=_earlier(pulse.contact, samples.start)) for pulse in pulses
    )
    # The channel's own samples where its clock is the force's, else those of the common grid.
    channel = Channel(
        Sensor(channel.name, "acceleration", "m/s2"), acceleration, grid.sampling_rate_hz
    )
    findings = _delays(channel, force, pulses)
    windows, origins, problem = _windows(channel, force, pulses, settings)
    speeds: list[ImpactSpeed | None] = []
    for i, (pulse, window, origin) in enumerate(zip(pulses, windows, origins, strict=True)):
        try:
            speed = impact_velocity(
                window,
                channel.sampling_rate_hz,
                pulse.contact.first - origin,
                pulse.contact.peak - origin,
            )
            speeds.append(ImpactSpeed(speed.velocity_m_s, speed.velocity_u_m_s))
        except ValueError as error:
            speeds.append(None)
            findings.append(
                Finding("no-impact-velocity", "warning", str(error), channel.name, contact=i)
            )
    return tuple(speeds), findings + problem


def _windows(
    channel: Channel,
    force: Floats,
    pulses: tuple[ExtractedPulse, ...],
    settings: ExtractionSettings,
) -> tuple[list[Floats], list[int], list[Finding]]:
    """The acceleration about each hit, its first sample in the record, and why it was not cleaned
    if it should be."""
    rate = channel.sampling_rate_hz
    origins = [max(0, pulse.contact.first - _BEFORE) for pulse in pulses]
    ends = [*origins[1:], force.size]
    longest = round(_LONGEST_WINDOW_S * rate)
    raw = [channel.readings[a : min(b, a + longest)] for a, b in zip(origins, ends, strict=True)]
    if not 0 < settings.deconvolve_from_hits <= len(pulses):
        return raw, origins, []
    segment = min(longest, *(b - a for a, b in zip(origins, ends, strict=True))) // 2 * 2
    try:
        cleaned = clean_acceleration(
            channel.readings,
            force,
            rate,
            np.array(origins, dtype=np.int64),
            segment=segment,
            band_hz=(settings.rigid_from_hz, settings.rigid_to_hz),
        )
    except TransferFunctionError as error:
        message = f"the hammer's own dynamics stay in its acceleration: {error}"
        return raw, origins, [Finding("not-deconvolved", "note", message, channel.name)]
    return list(cleaned), origins, []


def _delays(channel: Channel, force: Floats, pulses: tuple[ExtractedPulse, ...]) -> list[Finding]:
    speeds = []
    for i, pulse in enumerate(pulses):
        origin = max(0, pulse.contact.first - _BEFORE)
        near = slice(origin, pulse.contact.last + _BEFORE)  # a contact is short and the record long
        _refuse_not_finite(channel, channel.name, channel.readings, near)
        _refuse_not_finite(channel, "force", force, near)
        span = (pulse.contact.first - origin, pulse.contact.last - origin)
        delay = measured_delay_samples(force[near], channel.readings[near], *span)
        if not delay_is_plausible(delay, 0.0, channel.sampling_rate_hz):
            message = (
                f"acceleration follows force by {delay:.1f} samples; expected at "
                f"most two, the wave's travel"
            )
            speeds.append(
                Finding("delay", "warning", message, channel.name, {"delay_samples": delay}, i)
            )
    return speeds


def _refuse_not_finite(channel: Channel, name: str, values: Floats, near: slice) -> None:
    """Raise `RecordingError` for a sample of `values` (n,), on the clock of `channel`, that is no
    number."""
    lost = np.flatnonzero(~np.isfinite(values[near]))
    if lost.size:
        at = near.start + int(lost[0])
        raise RecordingError(
            f"channel {name!r} has no number at sample {at} "
            f"({channel.start_s + at * channel.period_s:.6g} s), beside a contact, so that no "
            "impact velocity can be integrated; record the hit again, or take the channel on the "
            "impactor out of campaign.toml"
        )


def propagation_delay(youngs_modulus_pa: float, density_kg_m3: float, length_m: float) -> float:
    """Time (s) of a compression wave along a slender bar.

    Parameters:
        youngs_modulus_pa: Young's modulus of the bar.
        density_kg_m3: Its density.
        length_m: Its length.

    Source:
        Thesis, eq. 4.1.
    """
    return length_m / math.sqrt(youngs_modulus_pa / density_kg_m3)


#: Samples by which a delay is looked for, and by which it may miss the wave's travel: the thesis'
#: discrepancy.
_LONGEST, _TOLERANCE = 16, 2.0


def measured_delay_samples(force: Floats, acceleration: Floats, first: int, last: int) -> float:
    """Samples by which an acceleration follows a force in a contact; negative: it leads.

    The peak of the cross-correlation, between samples by a cubic spline; either polarity. The
    answer is within ±16, and at that limit where the two are not alike.

    Parameters:
        force: The record (n,) of the force, in any unit.
        acceleration: The record (n,) of the acceleration, in any unit, on the same clock.
        first: The first sample of the contact.
        last: Its last sample.

    Raises:
        ValueError: For a contact outside the record.
    """
    if not 0 <= first < last < force.size or force.shape != acceleration.shape:
        raise ValueError(
            f"contact {first} to {last} in records of {force.shape} and "
            f"{acceleration.shape} samples"
        )
    from scipy.interpolate import CubicSpline

    around = np.pad(acceleration, _LONGEST)[first : last + 2 * _LONGEST + 1]
    likeness = np.correlate(around, force[first : last + 1], mode="valid")
    lags = np.arange(-_LONGEST, _LONGEST + 1)
    best = int(np.argmax(np.abs(likeness)))
    spline = CubicSpline(lags, likeness * np.sign(likeness[best]))
    turns = spline.derivative().roots(extrapolate=False)
    turns = turns[np.abs(turns - lags[best]) <= 1]
    return float(turns[np.argmax(spline(turns))]) if turns.size else float(lags[best])


def delay_is_plausible(delay_samples: float, wave_time_s: float, sampling_rate_hz: float) -> bool:
    """Whether a delay is the wave's travel to within two samples, either way.

    Parameters:
        delay_samples: The delay of the acceleration behind the force, in samples.
        wave_time_s: The time that the wave travels, as `propagation_delay` gives it.
        sampling_rate_hz: The sampling rate of the records.
    """
    return abs(delay_samples - wave_time_s * sampling_rate_hz) <= _TOLERANCE
