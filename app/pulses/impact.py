"""Everything that the store knows of one impact, as plain data."""

from __future__ import annotations

from typing import Any

from sqlalchemy import or_, select
from sqlalchemy.orm import Session

from ...schema.impacts import Impact, Pulse
from ...schema.listings import Condition, iter_impacts
from ...schema.provenance import Provenance
from ...schema.quality import QualityFinding
from ...schema.recordings import RecordedChannel


def impact_page(session: Session, key: int) -> dict[str, Any]:
    """One impact: its listing's row, then lists of pulse versions, findings and channels. `LookupError` if unknown."""
    impact = get_impact(session, key)
    row = next(iter_impacts(session, where=(Condition("id", "=", key),)))
    return {
        **row,
        "impact_velocity_u_m_s": impact.impact_velocity_u_m_s,
        "velocity_source": impact.velocity_source,
        "recording": impact.recording.path if impact.recording else None,
        "pulses": [_pulse(session, pulse) for pulse in _pulses(session, key)],
        "findings": _findings(session, impact),
        "channels": _channels(session, impact),
    }


def get_impact(session: Session, key: int) -> Impact:
    """The impact with this key; `LookupError` otherwise."""
    impact = session.get(Impact, key)
    if impact is None:
        raise LookupError(f"no impact {key} in the store; pyroshock impacts lists them")
    return impact


def _pulses(session: Session, key: int) -> list[Pulse]:
    return list(session.scalars(select(Pulse).where(Pulse.impact_id == key).order_by(Pulse.id)))


def _pulse(session: Session, pulse: Pulse) -> dict[str, Any]:
    writer = session.get_one(Provenance, pulse.written_by_id)
    return {
        "in_use": "yes" if pulse.current else "no",
        "segmentation": pulse.settings.settings["segmentation"],
        "threshold": pulse.settings.settings["threshold"],
        "smoothing": pulse.settings.settings["smoothing"],
        "start_s": pulse.start_s,
        "contact_time_s": pulse.contact_time_s,
        "peak_force_n": pulse.peak_force_n,
        "spline_peak_force_n": pulse.spline_peak_force_n,
        "impulse_n_s": pulse.impulse_n_s,
        "width_half_s": pulse.width_half_s,
        "samples_in_contact": pulse.samples_in_contact,
        "spline_nrmse": pulse.spline_nrmse,
        "segmentation_difference": pulse.segmentation_difference,
        "written_by": f"{writer.software_version}: {writer.command}",
    }


def _findings(session: Session, impact: Impact) -> list[dict[str, Any]]:
    if impact.recording_id is None:
        return []
    mine = or_(QualityFinding.impact_id == impact.id, QualityFinding.impact_id.is_(None))
    query = (
        select(QualityFinding.severity, QualityFinding.check, RecordedChannel.name, QualityFinding.message)
        .outerjoin(RecordedChannel, QualityFinding.channel_id == RecordedChannel.id)
        .where(QualityFinding.recording_id == impact.recording_id, mine)
    )
    heads = ("severity", "check", "channel", "message")
    return [dict(zip(heads, row, strict=True)) for row in session.execute(query.order_by(QualityFinding.id))]


def _channels(session: Session, impact: Impact) -> list[dict[str, Any]]:
    query = select(RecordedChannel).where(RecordedChannel.recording_id == impact.recording_id)
    return [
        {
            "channel": c.name,
            "quantity": c.quantity,
            "unit": c.unit,
            "sampling_rate_hz": c.sampling_rate_hz,
            "samples": c.samples,
            "sha256": c.sha256[:12],
        }
        for c in session.scalars(query.order_by(RecordedChannel.name))
    ]
