"""Velocities, pressures and findings of a hit as rows hold them: the lab's own word before what its record gives."""

from __future__ import annotations

from ..signals.checks.base import Finding
from .matching import MatchedImpact
from .processing import ProcessedRecording
from .runs import RunRow
from .stored_rows import reported_uncertainty


def impact_values(row: RunRow, hit: MatchedImpact, done: ProcessedRecording | None) -> dict[str, object]:
    if row.impact_velocity_m_s is not None:
        return {
            "impact_velocity_m_s": row.impact_velocity_m_s,
            "impact_velocity_u_m_s": row.impact_velocity_u_m_s,
            "velocity_source": "reported",
        }
    speed = done.speeds[hit.pulse] if done and hit.pulse is not None and done.speeds else None
    if speed is None:
        return {}
    return {
        "impact_velocity_m_s": speed.velocity_m_s,
        "impact_velocity_u_m_s": speed.velocity_u_m_s,
        "velocity_source": speed.source,
    }


def hit_velocity(row: RunRow, hit: MatchedImpact, done: ProcessedRecording) -> float | None:
    """The impact velocity by whatever tells it first: the row, the impactor's acceleration, the shot (m/s)."""
    velocity = impact_values(row, hit, done).get("impact_velocity_m_s")
    shot = done.shot.velocity_m_s if done.shot else None
    best = velocity if isinstance(velocity, float) else row.measured_velocity_m_s or shot
    return None if best is None else float(best)


def shot_values(row: RunRow, done: ProcessedRecording | None) -> dict[str, object]:
    values: dict[str, object] = {
        "tank_pressure_pa": row.number("tank_pressure"),
        "bullet_mass_kg": row.number("bullet_mass"),
        "bullet_length_m": row.bullet_length_m,
    }
    shot = done.shot if done else None
    if shot and shot.tank_pressure_pa is not None:
        values |= {"recorded_pressure_pa": shot.tank_pressure_pa, "recorded_pressure_u_pa": shot.tank_pressure_u_pa}
    if row.measured_velocity_m_s is not None:
        values |= {
            "measured_velocity_m_s": row.measured_velocity_m_s,
            "measured_velocity_u_m_s": reported_uncertainty(row),
            "velocity_source": "reported",
        }
    elif shot and shot.velocity_m_s is not None:
        values |= {
            "measured_velocity_m_s": shot.velocity_m_s,
            "measured_velocity_u_m_s": shot.velocity_u_m_s,
            "velocity_source": "laser",
        }
    return values


def finding_values(
    finding: Finding, recording_id: int, channels: dict[str, int], impacts: dict[int, int]
) -> dict[str, object]:
    return {
        "recording_id": recording_id,
        "channel_id": channels.get(finding.channel),
        "impact_id": impacts.get(finding.contact) if finding.contact is not None else None,
        "check": finding.check,
        "severity": finding.severity,
        "message": finding.message,
        "evidence": finding.evidence,
    }
