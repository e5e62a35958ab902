"""What a gun's recording says of the shot: muzzle velocity from the laser, tank pressure before the
valve opened, and, for recordings that no trigger began, when it opened, from the drop of the
pressure alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...signals.channel import Channel
from ...signals.checks.base import Finding
from ..folder.runs_table import RunRow
from .pressure_drop import NoDropError, PressureDrop, ShortRestError, pressure_drop
from .velocity import NoPassageError, muzzle_velocity, muzzle_velocity_uncertainty

#: The check of a finding on a record that begins within the drop of its pressure.
SHORT_REST = "no-rest-before-drop"


@dataclass(frozen=True)
class ValveOpening:
    """The moment at which the port begins to open, on the recording's clock, and when the drop
    shows.

    `time_u_s` is a standard uncertainty: of the noise and of the law of the drop (`pressure_drop`).
    The drop exceeds the noise at `seen_s`; `power` is the mean exponent of time.
    """

    time_s: float
    time_u_s: float
    seen_s: float
    power: float


#: Where a laser across the barrel stands in campaign.toml's `position`; a channel named laser… is
#: one too.
MUZZLE_POSITIONS = ("muzzle", "barrel")


@dataclass(frozen=True)
class ShotMeasurement:
    """Measured values with their standard uncertainties; None where the channel is missing or tells
    nothing."""

    velocity_m_s: float | None = None
    velocity_u_m_s: float | None = None
    tank_pressure_pa: float | None = None
    tank_pressure_u_pa: float | None = None
    valve_opening: ValveOpening | None = None


def laser_channel(channels: list[Channel]) -> Channel | None:
    """The channel that sees the bullet pass: a displacement or voltage at the muzzle, or one named
    laser…

    Parameters:
        channels: The channels of the recording; of several such ones the first is taken.
    """
    for channel in channels:
        at_muzzle = (channel.sensor.position or "").lower() in MUZZLE_POSITIONS
        if channel.quantity in ("displacement", "voltage") and (
            at_muzzle or channel.name.lower().startswith("laser")
        ):
            return channel
    return None


def measure_shot(
    channels: list[Channel], bullet_length_m: float | None, bullet_length_u_m: float | None
) -> tuple[ShotMeasurement | None, list[Finding]]:
    """Velocity and pressure of a shot, and findings where a channel is there but says nothing
    usable.

    Parameters:
        channels: The channels of the recording.
        bullet_length_m: The length of the bullet; None where it is unknown, which gives no
            velocity.
        bullet_length_u_m: Its standard uncertainty; None takes that of `muzzle_velocity`.

    Returns:
        The measured values, None where neither velocity nor pressure was measured, and the
        findings.

    Source:
        Thesis, eq. 5.2, for the velocity.
    """
    velocity, problems = _velocity(laser_channel(channels), bullet_length_m, bullet_length_u_m)
    tank = next((c for c in channels if c.quantity == "pressure"), None)
    drop, more = _drop(tank)
    if velocity == (None, None) and drop is None:
        return None, problems + more
    if tank is None or drop is None:
        return ShotMeasurement(*velocity), problems + more
    # The calibration is common to all shots, and is not averaged out by them.
    pressure_u = math.hypot(drop.pressure_u_pa, tank.sensor.calibration_u_si(drop.pressure_pa))
    opening = ValveOpening(
        tank.start_s + drop.time_s, drop.time_u_s, tank.start_s + drop.seen_s, drop.power
    )
    return ShotMeasurement(*velocity, drop.pressure_pa, pressure_u, opening), problems + more


Pair = tuple[float | None, float | None]


def _velocity(
    laser: Channel | None, length: float | None, length_u: float | None
) -> tuple[Pair, list[Finding]]:
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


def _drop(channel: Channel | None) -> tuple[PressureDrop | None, list[Finding]]:
    if channel is None:
        return None, []
    try:
        return pressure_drop(channel.readings, channel.sampling_rate_hz), []
    except ShortRestError as error:
        return None, [Finding(SHORT_REST, "warning", f"no initial pressure: {error}", channel.name)]
    except (NoDropError, ValueError) as error:
        return None, [Finding("no-pressure-drop", "note", str(error), channel.name)]


def reported_uncertainty(row: RunRow) -> float | None:
    """The standard uncertainty (m/s) of the velocity that a row reports: the lab's own; else that
    of the laser where bullet length and laser sampling rate are given, else None.

    Parameters:
        row: The row of the table of runs.

    Source:
        Thesis, eq. 5.2.
    """
    if row.measured_velocity_u_m_s is not None or not row.measured_velocity_m_s:
        return row.measured_velocity_u_m_s
    if row.bullet_length_m is None or row.laser_sampling_rate_hz is None:
        return None
    transit = row.bullet_length_m / row.measured_velocity_m_s
    length_u = {} if row.bullet_length_u_m is None else {"length_u_m": row.bullet_length_u_m}
    period = 1.0 / row.laser_sampling_rate_hz
    return float(
        muzzle_velocity_uncertainty(row.bullet_length_m, transit, time_u_s=period, **length_u)
    )
