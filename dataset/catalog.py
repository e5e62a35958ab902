"""The snapshots there are.

Snapshots whose pulses went with a campaign or recording that was deleted, as tombstones of the
store tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ..schema.impacts import DatasetSnapshot, SnapshotPulse
from ..schema.provenance import Tombstone

#: Digits of a hash that stand for a snapshot on the command line.
_SHORTEST_HASH = 8


def get_snapshot_row(session: Session, name: str) -> DatasetSnapshot:
    """The row of a snapshot.

    Parameters:
        session: A session of the store.
        name: The name of the snapshot or its hash, or the start of the hash, eight digits at least.

    Raises:
        LookupError: For an unknown snapshot, with those there are.
    """
    row = session.scalars(select(DatasetSnapshot).where(DatasetSnapshot.name == name)).one_or_none()
    if row is not None:
        return row
    if len(name) >= _SHORTEST_HASH and set(name) <= set("0123456789abcdef"):
        query = select(DatasetSnapshot).where(
            DatasetSnapshot.content_hash.startswith(name, autoescape=True)
        )
        matches = session.scalars(query.limit(2)).all()
        if len(matches) == 1:
            return matches[0]
    existing_names = ", ".join(
        session.scalars(select(DatasetSnapshot.name).order_by(DatasetSnapshot.name).limit(10))
    )
    raise LookupError(
        f"no dataset {name!r} in the store; there: "
        f"{existing_names or 'none yet (pyroshock dataset build)'}"
    )


def list_snapshots(session: Session) -> list[dict[str, Any]]:
    """Every snapshot, the oldest first: name, hash, pulses, campaigns, predictors, quality rule,
    when it was frozen.

    Parameters:
        session: A session of the store.
    """
    counts = select(SnapshotPulse.snapshot_id, func.count()).group_by(SnapshotPulse.snapshot_id)
    pulses: dict[int, int] = dict(iter(session.execute(counts)))
    rows = session.scalars(
        select(DatasetSnapshot).order_by(DatasetSnapshot.id)
    )  # not by a clock, which may go back
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


@dataclass(frozen=True)
class Withdrawal:
    """Pulses that a dataset lost by deletions: how many, of how many that it was frozen with, and
    the last deletion."""

    dataset: str
    hash: str
    lost: int
    frozen: int
    source: str  # what was deleted last, when and why
    error: str  # why the dataset cannot be read, and what to do

    @property
    def words(self) -> str:
        """A sentence for listings."""
        return (
            f"{self.lost} of the {self.frozen} pulses of dataset {self.dataset} (hash "
            f"{self.hash[:12]}) were withdrawn: they stood on {self.source})"
        )


def source_deleted(session: Session, row: DatasetSnapshot) -> str | None:
    """What to say of a snapshot that has fewer pulses than before a deletion; None where deletions
    do not explain all that it lacks.

    Parameters:
        session: A session of the store.
        row: The row of the snapshot, as `get_snapshot_row` gives it.
    """
    withdrawal = _withdrawal(
        session, row, session.scalars(select(Tombstone).order_by(Tombstone.id)).all()
    )
    return None if withdrawal is None else withdrawal.error


def list_withdrawals(session: Session) -> dict[str, Withdrawal]:
    """Datasets that lost pulses by deletions and have not got them back, by hash.

    Parameters:
        session: A session of the store.
    """
    stones = session.scalars(select(Tombstone).order_by(Tombstone.id)).all()
    hashes = {member["hash"] for stone in stones for member in stone.stood_on["datasets"]}
    rows = (
        session.scalars(select(DatasetSnapshot).where(DatasetSnapshot.content_hash.in_(hashes)))
        if hashes
        else ()
    )
    withdrawals = [_withdrawal(session, row, stones) for row in rows]
    return {withdrawal.hash: withdrawal for withdrawal in withdrawals if withdrawal is not None}


def _withdrawal(
    session: Session, row: DatasetSnapshot, stones: Sequence[Tombstone]
) -> Withdrawal | None:
    entries = [
        (stone, entry)
        for stone in stones
        for entry in stone.stood_on["datasets"]
        if entry["hash"] == row.content_hash and entry["pulses"] > entry.get("returned", 0)
    ]
    if not entries:
        return None
    pulses = session.scalar(select(func.count()).where(SnapshotPulse.snapshot_id == row.id)) or 0
    frozen = max(entry["before"] for _, entry in entries)
    explained = sum(entry["pulses"] - entry.get("returned", 0) for _, entry in entries)
    if not 0 < frozen - pulses <= explained:
        return None
    stone = entries[-1][0]
    source = _source(stone)
    return Withdrawal(
        row.name, row.content_hash, frozen - pulses, frozen, source, _error(row, stone, source)
    )


def _source(stone: Tombstone) -> str:
    what = f"campaign {stone.campaign!r}"
    if stone.recording is not None:
        what = f"recording {stone.recording!r} of {what}"
    return f"{what}, which was deleted on {stone.deleted_at:%Y-%m-%d} ({stone.reason}"


def _error(row: DatasetSnapshot, stone: Tombstone, source: str) -> str:
    if stone.archive_path is not None:
        again = f"pyroshock campaigns restore {stone.archive_path} brings it back"
    elif stone.recording is not None and stone.replaced_by is None:
        again = f"pyroshock ingest FOLDER --again {stone.recording} brings it back"
    else:
        again = "ingest the same again and build it again"
    return (
        f"dataset {row.name!r} (hash {row.content_hash[:12]}) stood on {source}; tombstone "
        f"{stone.id}, content {stone.content_hash[:12]}): models that were trained on it stay; "
        f"{again}, or build another dataset"
    )
