"""The snapshots there are."""

from __future__ import annotations

from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ..schema.datasets import DatasetSnapshot, SnapshotPulse

#: Digits of a hash that stand for a snapshot on the command line.
_SHORTEST_HASH = 8


def get_snapshot_row(session: Session, name: str) -> DatasetSnapshot:
    """The row of a snapshot by name, hash or start of a hash. Raises `LookupError` naming those there are."""
    row = session.scalars(select(DatasetSnapshot).where(DatasetSnapshot.name == name)).one_or_none()
    if row is not None:
        return row
    if len(name) >= _SHORTEST_HASH and set(name) <= set("0123456789abcdef"):
        query = select(DatasetSnapshot).where(DatasetSnapshot.content_hash.startswith(name, autoescape=True))
        matches = session.scalars(query.limit(2)).all()
        if len(matches) == 1:
            return matches[0]
    existing_names = ", ".join(session.scalars(select(DatasetSnapshot.name).order_by(DatasetSnapshot.name).limit(10)))
    raise LookupError(
        f"no dataset {name!r} in the store; there: {existing_names or 'none yet (pyroshock dataset build)'}"
    )


def list_snapshots(session: Session) -> list[dict[str, Any]]:
    """Every snapshot, the oldest first: name, hash, pulses, campaigns, predictors, quality rule, when it was frozen."""
    counts = select(SnapshotPulse.snapshot_id, func.count()).group_by(SnapshotPulse.snapshot_id)
    pulses: dict[int, int] = dict(iter(session.execute(counts)))
    rows = session.scalars(select(DatasetSnapshot).order_by(DatasetSnapshot.id))  # not by a clock, which may go back
    return [
        {
            "name": row.name,
            "hash": row.content_hash,
            "pulses": pulses.get(row.id, 0),
            "campaigns": row.definition.get("campaigns"),
            "predictors": (row.definition.get("predictors") or {}).get("name"),
            "quality": row.definition.get("quality"),
            "frozen_at": row.frozen_at.isoformat(timespec="seconds"),
        }
        for row in rows
    ]
