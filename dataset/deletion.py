"""A dataset deleted from the store; its pulses stay with their campaigns."""

from __future__ import annotations

from sqlalchemy import delete
from sqlalchemy.orm import Session

from ..schema.impacts import DatasetSnapshot, SnapshotPulse
from .catalog import get_snapshot_row


def delete_snapshot(session: Session, name: str) -> None:
    """Delete the dataset of this name or hash. Raises `LookupError` as `get_snapshot_row`.

    Whether models were trained on it is for the caller to ask: the store does not know them.
    """
    key = get_snapshot_row(session, name).id
    session.execute(delete(SnapshotPulse).where(SnapshotPulse.snapshot_id == key))
    session.execute(delete(DatasetSnapshot).where(DatasetSnapshot.id == key))
