"""Snapshots whose pulses went with a campaign or recording that was deleted, as a tombstone of the store tells."""

from __future__ import annotations

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ..schema.datasets import DatasetSnapshot, SnapshotPulse
from ..schema.tombstones import Tombstone


def source_deleted(session: Session, row: DatasetSnapshot) -> str | None:
    """What to say of a snapshot that has fewer pulses than before a deletion; None where no deletion explains it."""
    pulses = session.scalar(select(func.count()).where(SnapshotPulse.snapshot_id == row.id)) or 0
    for stone in session.scalars(select(Tombstone).order_by(Tombstone.id.desc())):
        if any(each["hash"] == row.content_hash and pulses < each["before"] for each in stone.stood_on["datasets"]):
            return _said(row, stone)
    return None


def _said(row: DatasetSnapshot, stone: Tombstone) -> str:
    what = f"campaign {stone.campaign!r}"
    if stone.recording is not None:
        what = f"recording {stone.recording!r} of {what}"
    when = f"{stone.deleted_at:%Y-%m-%d}"
    return (
        f"dataset {row.name!r} (hash {row.content_hash[:12]}) stood on {what}, which was deleted on {when} "
        f"({stone.reason}; tombstone {stone.id}, content {stone.content_hash[:12]}): models that were trained on it "
        "stay; ingest the same again and build it again, or build another dataset"
    )
