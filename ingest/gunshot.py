"""What a gun's recording says of the shot: muzzle velocity from the laser, tank pressure before the valve opened."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from ..signals.channel import Channel
from ..signals.checks.base import Finding
from .laser import NoPassageError, muzzle_velocity
from .tank_pressure import NoDropError, tank_pressure_before
from .valve_opening import ValveOpening, valve_opening

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
        opening = muzzle_velocity(laser.si, laser.sampling_rate_hz, length, **given)
    except (NoPassageError, ValueError) as error:
        return (None, None), [Finding("no-passage", "warning", str(error), laser.name)]
    return (opening.velocity_m_s, opening.velocity_u_m_s), []


def _pressure(channel: Channel | None) -> tuple[Pair, list[Finding]]:
    if channel is None:
        return (None, None), []
    try:
        opening = tank_pressure_before(channel.si)
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
        opening = valve_opening(channel.si, channel.sampling_rate_hz)
    except (NoDropError, ValueError):
        return None
    return replace(opening, time_s=channel.start_s + opening.time_s, seen_s=channel.start_s + opening.seen_s)
