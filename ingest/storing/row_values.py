"""The values of a recording's rows: what was extracted, in the columns of the store. The lab's own
word on a velocity or pressure goes before what the record gives."""

from __future__ import annotations

from dataclasses import fields
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import bindparam, select
from sqlalchemy.orm import Session

from ...schema.impacts import ExtractionSettingsRow as SettingsRow
from ...schema.impacts import Pulse
from ...schema.series import encode
from ...schema.transactions import add_or_get
from ...signals.checks.base import Finding
from ..extraction.gunshot import reported_uncertainty
from ..extraction.pulses import ExtractedPulse
from ..extraction.recording import EncodedChannel, ExtractedRecording
from ..extraction.row_matching import MatchedImpact
from ..extraction.settings import EXTRACTION_VERSION, ExtractionSettings
from ..folder.runs_table import RunRow

_SETTINGS = select(SettingsRow.id).where(SettingsRow.fingerprint == bindparam("fingerprint"))


def settings_id(session: Session, settings: ExtractionSettings) -> int:
    """Key of these extraction settings at this version of the code."""
    stored = session.scalar(_SETTINGS, {"fingerprint": settings.fingerprint})
    if stored is not None:
        return stored
    values = {"code_version": EXTRACTION_VERSION, "settings": settings.as_json()}
    return add_or_get(session, SettingsRow, {"fingerprint": settings.fingerprint}, values).id


def channel_values(series: EncodedChannel) -> dict[str, Any]:
    """The row of a channel (its frames are written by `schema.series.write_series`), but for its
    recording."""
    channel = series.channel
    sensor = channel.sensor
    gain, offset = sensor.conversion
    return {
        "name": sensor.name,
        "quantity": sensor.quantity,
        "unit": sensor.unit,
        "sensitivity": sensor.sensitivity,
        "offset_v": sensor.offset_v if sensor.sensitivity is not None else None,
        "position": sensor.position,
        "axis": sensor.axis,
        "full_scale": sensor.range,
        "si_unit": channel.si_unit,
        "si_gain": gain,
        "si_offset": offset,
        "sampling_rate_hz": channel.sampling_rate_hz,
        "start_s": channel.start_s,
        "samples": series.encoded.samples,
        "dtype": series.encoded.layout.dtype,
        "chunk_samples": series.encoded.layout.chunk_samples,
        "step": series.encoded.layout.step,
        "sha256": series.encoded.sha256,
        "header": channel.header,
    }


#: Columns of a pulse that its extraction gives by their names.
_MEASURED = sorted(
    {column.name for column in Pulse.__table__.columns}
    & {field.name for field in fields(ExtractedPulse)}
)


def pulse_values(pulse: ExtractedPulse, impact_id: int, settings: int) -> dict[str, Any]:
    """The row of a pulse in use."""
    return {
        "impact_id": impact_id,
        "settings_id": settings,
        "current": True,
        "extracted_at": datetime.now(UTC),
        **{name: getattr(pulse, name) for name in _MEASURED},
        "force_points_n": [float(x) for x in pulse.force_points_n],
        "fine_force_n": encode(pulse.fine_force_n),
    }


def impact_values(hit: MatchedImpact, done: ExtractedRecording | None) -> dict[str, object]:
    row = hit.row
    if row.impact_velocity_m_s is not None:
        return {
            "impact_velocity_m_s": row.impact_velocity_m_s,
            "impact_velocity_u_m_s": row.impact_velocity_u_m_s,
            "velocity_source": "reported",
        }
    speed = done.speed_of(hit) if done else None
    if speed is None:
        return {}
    return {
        "impact_velocity_m_s": speed.velocity_m_s,
        "impact_velocity_u_m_s": speed.velocity_u_m_s,
        "velocity_source": speed.source,
    }


def shot_values(row: RunRow, done: ExtractedRecording | None) -> dict[str, object]:
    values: dict[str, object] = {
        "tank_pressure_pa": row.number("tank_pressure"),
        "bullet_mass_kg": row.number("bullet_mass"),
        "bullet_length_m": row.bullet_length_m,
    }
    shot = done.shot if done else None
    if shot and shot.tank_pressure_pa is not None:
        values |= {
            "recorded_pressure_pa": shot.tank_pressure_pa,
            "recorded_pressure_u_pa": shot.tank_pressure_u_pa,
        }
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
