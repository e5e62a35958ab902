"""What was corrected of a campaign, and after which moment: what was made before rests on the
earlier values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from .campaigns import Campaign
from .corrections import FactCorrection
from .impacts import DatasetSnapshot, Impact, Pulse, SnapshotPulse
from .provenance import Provenance


@dataclass(frozen=True)
class StoredCorrection:
    """A correction as it is shown. `earlier` are the values that were stated before (None: none was
    stated), each with its hits; `by` is who did it."""

    campaign: str
    fact: str
    earlier: tuple[tuple[str | None, tuple[tuple[int, int], ...]], ...]
    value: str
    reason: str
    corrected_at: datetime
    by: str

    @property
    def earlier_words(self) -> str:
        """`30 (11 impacts), not stated (3)`, or the one value of a fact of the campaign."""
        parts = [
            ("not stated" if value is None else value, len(hits)) for value, hits in self.earlier
        ]
        return ", ".join(f"{words} ({count})" if count else words for words, count in parts)

    @property
    def runs(self) -> tuple[int, ...]:
        """The runs that it is of; none of a fact of the campaign."""
        return tuple(sorted({run for _, hits in self.earlier for run, _ in hits}))

    @property
    def words(self) -> str:
        """One sentence: what it was, what it is, when and why."""
        was = (
            f"{self.fact} of campaign {self.campaign} was added: {self.value}"
            if all(value is None for value, _ in self.earlier)
            else f"{self.fact} of campaign {self.campaign} was corrected from "
            f"{self.earlier_words} to {self.value}"
        )
        return f"{was}, on {self.corrected_at:%Y-%m-%d} ({self.reason})."


def list_corrections(
    session: Session, campaigns: Sequence[str], after: datetime | None = None
) -> list[StoredCorrection]:
    """Corrections of campaigns, the newest first.

    Parameters:
        session: A session of the store.
        campaigns: Names of campaigns.
        after: The moment before which corrections are left out; None gives all.
    """
    query = (
        select(FactCorrection, Campaign.name, Provenance.user)
        .join(Campaign, FactCorrection.campaign_id == Campaign.id)
        .join(Provenance, FactCorrection.written_by_id == Provenance.id)
        .where(Campaign.name.in_(campaigns))
        .order_by(FactCorrection.id.desc())
    )
    if after is not None:
        query = query.where(FactCorrection.corrected_at > after)
    return [_stored(row, name, user) for row, name, user in session.execute(query)]


def _stored(row: FactCorrection, campaign: str, user: str) -> StoredCorrection:
    earlier = tuple(
        (entry["value"], tuple((run, repetition) for run, repetition in entry["hits"]))
        for entry in row.earlier
    )
    return StoredCorrection(
        campaign, row.fact, earlier, row.value, row.reason, row.corrected_at, user
    )


def corrections_since_dataset(session: Session, name: str) -> list[StoredCorrection]:
    """Corrections of facts that the pulses of a frozen dataset were made with, which it does not
    have.

    Parameters:
        session: A session of the store.
        name: The name of the dataset; of one that there is not, nothing was corrected.
    """
    dataset = session.execute(
        select(DatasetSnapshot.id, DatasetSnapshot.frozen_at).where(DatasetSnapshot.name == name)
    ).one_or_none()
    if dataset is None or not session.scalar(select(func.count()).select_from(FactCorrection)):
        return []
    hits: Mapping[str, set[tuple[int, int]]] = _hits_of(session, dataset.id)
    return [
        correction
        for correction in list_corrections(session, list(hits), dataset.frozen_at)
        if _concerns(correction, hits[correction.campaign])
    ]


def _hits_of(session: Session, dataset: int) -> dict[str, set[tuple[int, int]]]:
    query = (
        select(Campaign.name, Impact.run, Impact.repetition)
        .join(Impact, Impact.campaign_id == Campaign.id)
        .join(Pulse, Pulse.impact_id == Impact.id)
        .join(SnapshotPulse, SnapshotPulse.pulse_id == Pulse.id)
        .where(SnapshotPulse.snapshot_id == dataset)
    )
    hits: dict[str, set[tuple[int, int]]] = {}
    for campaign, run, repetition in session.execute(query):
        hits.setdefault(campaign, set()).add((run, repetition))
    return hits


def _concerns(correction: StoredCorrection, hits: set[tuple[int, int]]) -> bool:
    own: set[Any] = {hit for _, of_value in correction.earlier for hit in of_value}
    return not own or bool(own & hits)
