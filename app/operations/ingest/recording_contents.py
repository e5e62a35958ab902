"""What the store holds of one recording, as plain data."""

from __future__ import annotations

from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ....schema.impacts import Impact, Shot
from ....schema.recordings import QualityFinding, RecordedChannel, Recording
from ....schema.removal.part import recording_part

_CHANNEL = (
    RecordedChannel.name,
    RecordedChannel.quantity,
    RecordedChannel.sampling_rate_hz,
    RecordedChannel.samples,
)
_FINDING = (QualityFinding.severity, QualityFinding.check, QualityFinding.message)


def recording_contents(session: Session, campaign: str, path: str) -> dict[str, Any]:
    """One recording of a campaign: its file, then lists of impacts, shots, channels and findings.

    Raises `LookupError` for what is not in the store.
    """
    key = recording_part(session, campaign, path).recording_id
    row = session.get_one(Recording, key)
    return {
        "recording": row.path,
        **{
            name: getattr(row, name)
            for name in ("status", "reason", "format", "size_bytes", "sha256")
        },
        "impacts": _rows(session, select(Impact.id, Impact.run, Impact.repetition), Impact, key),
        "shots": _rows(session, select(Shot.id, Shot.run, Shot.repetition), Shot, key),
        "channels": _rows(session, select(*_CHANNEL), RecordedChannel, key),
        "findings": _rows(session, select(*_FINDING), QualityFinding, key),
    }


def _rows(session: Session, query: Any, table: Any, key: int | None) -> list[dict[str, Any]]:
    rows = session.execute(query.where(table.recording_id == key).order_by(table.id))
    return [dict(row) for row in rows.mappings()]
