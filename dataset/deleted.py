"""Snapshots whose pulses went with a campaign or recording that was deleted, as tombstones of the store tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ..schema.datasets import DatasetSnapshot, SnapshotPulse
from ..schema.tombstones import Tombstone


@dataclass(frozen=True)
class Withdrawal:
    """Pulses that a dataset lost by deletions: how many, of how many that it was frozen with, and the last deletion."""

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
            f"{self.lost} of the {self.frozen} pulses of dataset {self.dataset} (hash {self.hash[:12]}) were "
            f"withdrawn: they stood on {self.source})"
        )


def source_deleted(session: Session, row: DatasetSnapshot) -> str | None:
    """What to say of a snapshot that has fewer pulses than before a deletion; None where deletions do not explain all
    that it lacks."""
    withdrawal = _withdrawal(session, row, session.scalars(select(Tombstone).order_by(Tombstone.id)).all())
    return None if withdrawal is None else withdrawal.error


def list_withdrawals(session: Session) -> dict[str, Withdrawal]:
    """Datasets that lost pulses by deletions and have not got them back, by hash."""
    stones = session.scalars(select(Tombstone).order_by(Tombstone.id)).all()
    hashes = {member["hash"] for stone in stones for member in stone.stood_on["datasets"]}
    rows = session.scalars(select(DatasetSnapshot).where(DatasetSnapshot.content_hash.in_(hashes))) if hashes else ()
    withdrawals = [_withdrawal(session, row, stones) for row in rows]
    return {withdrawal.hash: withdrawal for withdrawal in withdrawals if withdrawal is not None}


def _withdrawal(session: Session, row: DatasetSnapshot, stones: Sequence[Tombstone]) -> Withdrawal | None:
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
    return Withdrawal(row.name, row.content_hash, frozen - pulses, frozen, source, _error(row, stone, source))


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
        f"dataset {row.name!r} (hash {row.content_hash[:12]}) stood on {source}; tombstone {stone.id}, content "
        f"{stone.content_hash[:12]}): models that were trained on it stay; {again}, or build another dataset"
    )
