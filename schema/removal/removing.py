"""Rows of a campaign or recording taken out of the store, in one transaction with the tombstone that tells of them."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from ..campaigns import Campaign
from ..datasets import SnapshotPulse
from ..diagnoses import Diagnosis
from ..impacts import ChannelFigures, Impact, Pulse
from ..plans import Plan, PlannedRun
from ..quality import QualityFinding
from ..recordings import RecordedChannel, Recording, SeriesChunk
from ..shots import Shot
from ..tombstones import CAMPAIGN, Tombstone
from ..twins import TwinVersion
from .content import content_hash
from .part import Keys, Part
from .standing import adopted_on, datasets_on, diagnoses_on


def remove(
    session: Session,
    part: Part,
    reason: str,
    models: Sequence[dict[str, Any]] = (),
    archive: tuple[str, str] | None = None,
) -> Tombstone:
    """Delete the part's rows and add its tombstone, which is returned.

    Shared rows (parts of the bench, materials, configurations, plans) stay. Datasets stay with their hash and lose the
    pulses; runs of a plan that were done by what goes are to do again. Of a campaign its diagnoses and adopted effects
    go too: the tombstone keeps the reports and the effects. `models` are those that stood on the part's datasets,
    `archive` is the path and SHA-256 of the file that the campaign was written to. Raises `LookupError` where the part
    is no longer there.
    """
    # Nobody adds to the campaign meanwhile: PostgreSQL lets their rows wait, and SQLite has one writer at a time.
    there = session.scalar(select(Campaign.id).where(Campaign.id == part.campaign_id).with_for_update())
    if part.recording_id is not None and there is not None:
        there = session.scalar(select(Recording.id).where(Recording.id == part.recording_id))
    if there is None:
        raise LookupError(f"{part.kind} {part.recording or part.campaign!r} was deleted by somebody else meanwhile")
    stone = Tombstone(
        kind=part.kind,
        campaign=part.campaign,
        recording=part.recording,
        content_hash=content_hash(session, part),
        deleted_at=datetime.now(UTC),
        reason=reason,
        stood_on={
            "datasets": datasets_on(session, part),
            "models": list(models),
            "diagnoses": diagnoses_on(session, part),
            "adopted": adopted_on(session, part),
        },
        file_sha256=session.scalar(select(Recording.sha256).where(Recording.id == part.recording_id)),
        archive_path=None if archive is None else archive[0],
        archive_sha256=None if archive is None else archive[1],
    )
    planned = _planned(session, part)
    stone.counts = _delete(session, part)
    stone.stood_on["reopened"] = _reopened(session, planned)
    session.add(stone)
    session.flush()
    return stone


def _delete(session: Session, part: Part) -> dict[str, int]:
    """Rows that went, by table."""
    counts = {}
    for table, rows in _rows(part):
        result = session.execute(delete(table).where(rows), execution_options={"synchronize_session": False})
        counts[table.__tablename__] = int(result.rowcount)  # type: ignore[attr-defined]
    return {name: count for name, count in counts.items() if count}


def row_counts(session: Session, part: Part) -> dict[str, int]:
    """Rows that would go, by table."""
    counts = {
        table.__tablename__: session.scalar(select(func.count()).select_from(table).where(rows)) or 0
        for table, rows in _rows(part)
    }
    return {name: number for name, number in counts.items() if number}


def _rows(part: Part) -> list[tuple[Any, Any]]:
    """What goes, table by table: what points at others goes before them."""
    steps: list[tuple[Any, Any]] = [
        (SnapshotPulse, SnapshotPulse.pulse_id.in_(part.pulses)),
        (QualityFinding, QualityFinding.recording_id.in_(part.recordings)),
        (Pulse, Pulse.impact_id.in_(part.impacts)),
        (ChannelFigures, ChannelFigures.impact_id.in_(part.impacts)),
        (Shot, Shot.id.in_(part.shots)),
        (Impact, Impact.id.in_(part.impacts)),
        (SeriesChunk, SeriesChunk.channel_id.in_(part.channels)),
        (RecordedChannel, RecordedChannel.recording_id.in_(part.recordings)),
        (Recording, Recording.id.in_(part.recordings)),
    ]
    if part.kind == CAMPAIGN:
        steps = [
            (TwinVersion, TwinVersion.campaign_id == part.campaign_id),
            (Diagnosis, Diagnosis.campaign_id == part.campaign_id),
            *steps,
            (Campaign, Campaign.id == part.campaign_id),
        ]
    return steps


def _planned(session: Session, part: Part) -> list[int]:
    """Keys of the planned runs that the part's hits are linked to."""
    keys: set[int] = set()
    hits: tuple[tuple[type[Impact] | type[Shot], Keys], ...] = ((Impact, part.impacts), (Shot, part.shots))
    for table, own in hits:
        links = select(table.planned_run_id).where(table.id.in_(own), table.planned_run_id.is_not(None))
        keys.update(key for key in session.scalars(links.distinct()) if key is not None)
    return sorted(keys)


def _reopened(session: Session, planned: Sequence[int]) -> list[dict[str, Any]]:
    """Runs that were done and have too few repetitions now: to do again."""
    reopened = []
    for key in planned:
        run = session.get_one(PlannedRun, key)
        plan = session.get_one(Plan, run.plan_id)
        table = Shot if plan.kind == "gun" else Impact
        recorded = session.scalar(select(func.count()).where(table.planned_run_id == key)) or 0
        if run.status == "done" and recorded < run.repetitions:
            run.status = "planned"
            reopened.append({"plan": plan.name, "run": run.run})
    return reopened
