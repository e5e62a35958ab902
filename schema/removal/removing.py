"""Rows of a campaign or recording taken out of the store, in one transaction with the tombstone
that tells what stood on them: datasets, diagnoses and adopted effects. A hash of the content knows
the same files when they are ingested again."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import delete, exists, func, select
from sqlalchemy.orm import Session

from ..attachments import AttachedContent, AttachedPiece, Attachment
from ..campaign_counts import count_added
from ..campaign_rows import attached_to_campaign
from ..campaigns import Campaign, Configuration, Plan, PlannedRun
from ..corrections import FactCorrection
from ..diagnoses import Diagnosis, TwinVersion
from ..impacts import (
    ChannelFigures,
    DatasetSnapshot,
    ExtractionSettingsRow,
    Impact,
    Pulse,
    Shot,
    SnapshotPulse,
)
from ..provenance import CAMPAIGN, RECORDING, Tombstone
from ..recordings import QualityFinding, RecordedChannel, Recording, SeriesChunk
from ..run_predictions import SHOT_RUNS, shot_runs
from ..run_states import done_runs
from .content import figures_hashes
from .part import Keys, Part
from .returning import pulse_digests


def content_hash(session: Session, part: Part) -> str:
    """SHA-256 of what makes the content, without keys, clocks and writers, so that both engines
    give the same.

    These are the campaign's facts, the SHA-256 of each file and of each channel's samples, and of
    impacts, pulses and shots the configuration and the SHA-256 of the figures.
    """
    digest = hashlib.sha256()
    for kind, rows in _content(session, part):
        for row in sorted(rows, key=repr):
            digest.update(f"{kind} {tuple(map(_text, row))!r}\n".encode())
    return digest.hexdigest()


def _text(value: Any) -> str:
    return "" if value is None else str(value)


def _content(session: Session, part: Part) -> Iterator[tuple[str, list[tuple[Any, ...]]]]:
    facts = (Campaign.name, Campaign.kind, Campaign.date, Campaign.fingerprint)
    yield "campaign", _rows_of(session, select(*facts).where(Campaign.id == part.campaign_id))
    files = (Recording.path, Recording.sha256, Recording.status)
    yield "recording", _rows_of(session, select(*files).where(Recording.id.in_(part.recordings)))
    channels = select(Recording.path, RecordedChannel.name, RecordedChannel.sha256).join(
        Recording, RecordedChannel.recording_id == Recording.id
    )
    yield "channel", _rows_of(session, channels.where(Recording.id.in_(part.recordings)))
    tables: tuple[tuple[str, type[Impact] | type[Shot], Keys], ...] = (
        ("impact", Impact, part.impacts),
        ("shot", Shot, part.shots),
    )
    for kind, table, keys in tables:
        hashes = figures_hashes(session, table, keys)
        hits = select(table.id, table.run, table.repetition, Configuration.fingerprint)
        hits = hits.join(Configuration, table.configuration_id == Configuration.id).where(
            table.id.in_(keys)
        )
        yield kind, [(*row, hashes[key]) for key, *row in session.execute(hits)]
    hashes = figures_hashes(session, Pulse, part.pulses)
    pulses = select(Pulse.id, Impact.run, Impact.repetition, ExtractionSettingsRow.fingerprint)
    pulses = pulses.join(Impact, Pulse.impact_id == Impact.id)
    pulses = pulses.join(ExtractionSettingsRow, Pulse.settings_id == ExtractionSettingsRow.id)
    yield (
        "pulse",
        [
            (*row, hashes[key])
            for key, *row in session.execute(pulses.where(Pulse.id.in_(part.pulses)))
        ],
    )


def _rows_of(session: Session, query: Any) -> list[tuple[Any, ...]]:
    return [tuple(row) for row in session.execute(query)]


def attached_hash(session: Session, part: Part) -> str:
    """SHA-256 of what is attached to a campaign and its impacts: of each file what it is attached
    to, its name, caption and content, and when it was attached and removed.

    It stands beside `content_hash`, by which the same recordings are known again, whatever was
    attached to them.
    """
    columns = (
        *(Attachment.subject_kind, Attachment.run, Attachment.repetition, Attachment.file_name),
        *(Attachment.caption, AttachedContent.sha256, Attachment.author),
        *(Attachment.attached_at, Attachment.removed_at, Attachment.removal_reason),
    )
    query = select(*columns).join(AttachedContent, Attachment.content_id == AttachedContent.id)
    rows = _rows_of(session, query.where(attached_to_campaign(part.campaign_id)))
    digest = hashlib.sha256()
    for row in sorted(rows, key=repr):
        digest.update(f"{tuple(map(_text, row))!r}\n".encode())
    return digest.hexdigest()


def datasets_on(session: Session, part: Part) -> list[dict[str, Any]]:
    """Frozen datasets with pulses of this part: name, hash, how many, how many pulses they have at
    all, and digests."""
    every = (
        select(func.count())
        .where(SnapshotPulse.snapshot_id == DatasetSnapshot.id)
        .correlate(DatasetSnapshot)
    )
    query = (
        select(
            DatasetSnapshot.id,
            DatasetSnapshot.name,
            DatasetSnapshot.content_hash,
            func.count(),
            every.scalar_subquery(),
        )
        .join(SnapshotPulse, SnapshotPulse.snapshot_id == DatasetSnapshot.id)
        .where(SnapshotPulse.pulse_id.in_(part.pulses))
        .group_by(DatasetSnapshot.id, DatasetSnapshot.name, DatasetSnapshot.content_hash)
        .order_by(DatasetSnapshot.id)
    )
    keys = ("name", "hash", "pulses", "before")
    return [
        {
            **dict(zip(keys, row, strict=True)),
            "members": sorted(pulse_digests(session, part, key).values()),
        }
        for key, *row in session.execute(query).all()
    ]


def diagnoses_on(session: Session, part: Part) -> list[dict[str, Any]]:
    """Diagnoses of this part's campaign. Those of a campaign that goes are given with their report,
    which is kept."""
    rows = session.scalars(
        select(Diagnosis).where(Diagnosis.campaign_id == part.campaign_id).order_by(Diagnosis.id)
    )
    return [
        {
            "id": row.id,
            "diagnosed_at": row.diagnosed_at.isoformat(),
            "simulator": row.simulator,
            **({"report": row.report} if part.kind == CAMPAIGN else {}),
        }
        for row in rows
    ]


def adopted_on(session: Session, part: Part) -> list[dict[str, Any]]:
    """Versions of the twin's configuration that were adopted from diagnoses of this part's
    campaign."""
    query = (
        select(TwinVersion)
        .where(TwinVersion.campaign_id == part.campaign_id)
        .order_by(TwinVersion.version)
    )
    return [
        {
            "version": row.version,
            "diagnosis": row.diagnosis_id,
            "reason": row.reason,
            "adopted_at": row.adopted_at.isoformat(),
            "configuration": row.configuration,
        }
        for row in session.scalars(query)
    ]


def remove(
    session: Session,
    part: Part,
    reason: str,
    models: Sequence[dict[str, Any]] = (),
    archive: tuple[str, str] | None = None,
) -> Tombstone:
    """Delete the part's rows and add its tombstone, which is returned.

    Shared rows (parts of the bench, materials, configurations, plans) stay. Datasets stay with
    their hash and lose the pulses; runs of a plan that were done by what goes are to do again. Of a
    campaign its diagnoses and adopted effects go too: the tombstone keeps the reports and the
    effects. `models` are those that stood on the part's datasets, `archive` is the path and SHA-256
    of the file that the campaign was written to. Raises `LookupError` where the part is no longer
    there.
    """
    # Nobody adds to the campaign meanwhile: PostgreSQL lets their rows wait, and SQLite has one
    # writer at a time.
    there = session.scalar(
        select(Campaign.id).where(Campaign.id == part.campaign_id).with_for_update()
    )
    if part.recording_id is not None and there is not None:
        there = session.scalar(select(Recording.id).where(Recording.id == part.recording_id))
    if there is None:
        raise LookupError(
            f"{part.kind} {part.recording or part.campaign!r} was deleted by "
            f"somebody else meanwhile"
        )
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
        file_sha256=session.scalar(
            select(Recording.sha256).where(Recording.id == part.recording_id)
        ),
        archive_path=None if archive is None else archive[0],
        archive_sha256=None if archive is None else archive[1],
    )
    planned = _planned(session, part)
    done_before = done_runs(session, planned)
    if planned:  # a prediction that is made after this is made after the shot
        stone.stood_on[SHOT_RUNS] = shot_runs(session, planned)
    stone.counts = _delete(session, part)
    stone.stood_on["reopened"] = _reopened(session, done_before)
    session.add(stone)
    session.flush()
    return stone


def _delete(session: Session, part: Part) -> dict[str, int]:
    """Rows that went, by table."""
    counts = {}
    for table, rows in _rows(part):
        result = session.execute(
            delete(table).where(rows), execution_options={"synchronize_session": False}
        )
        counts[table.__tablename__] = int(result.rowcount)  # type: ignore[attr-defined]
    if part.kind == RECORDING:  # the kept numbers of a campaign go with its row
        removed_hits = (counts[table.__tablename__] for table in (Impact, Shot))
        count_added(session.connection(), part.campaign_id, *(-count for count in removed_hits))
    return {name: count for name, count in counts.items() if count}


def row_counts(session: Session, part: Part) -> dict[str, int]:
    """Rows that would go, by table."""
    counts = {
        table.__tablename__: session.scalar(select(func.count()).select_from(table).where(rows))
        or 0
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
            (FactCorrection, FactCorrection.campaign_id == part.campaign_id),
            *_attached_rows(part),
            *steps,
            (Campaign, Campaign.id == part.campaign_id),
        ]
    return steps


def _attached_rows(part: Part) -> list[tuple[Any, Any]]:
    """The attachments of a campaign, and the contents that nothing else has attached."""
    own = attached_to_campaign(part.campaign_id)
    elsewhere = exists().where(Attachment.content_id == AttachedContent.id, ~own)
    alone = ~elsewhere.correlate(AttachedContent)
    return [
        (AttachedPiece, AttachedPiece.content_id.in_(select(AttachedContent.id).where(alone))),
        (Attachment, own),
        (AttachedContent, alone),
    ]


def _planned(session: Session, part: Part) -> list[int]:
    """Keys of the planned runs that the part's hits are linked to."""
    keys: set[int] = set()
    hits: tuple[tuple[type[Impact] | type[Shot], Keys], ...] = (
        (Impact, part.impacts),
        (Shot, part.shots),
    )
    for table, own in hits:
        links = select(table.planned_run_id).where(
            table.id.in_(own), table.planned_run_id.is_not(None)
        )
        keys.update(key for key in session.scalars(links.distinct()) if key is not None)
    return sorted(keys)


def _reopened(session: Session, done_before: set[int]) -> list[dict[str, Any]]:
    """Of the runs that were done before, those that have too few repetitions now."""
    keys = done_before - done_runs(session, done_before)
    query = select(Plan.name, PlannedRun.run).join(Plan, PlannedRun.plan_id == Plan.id)
    query = query.where(PlannedRun.id.in_(keys)).order_by(PlannedRun.id)
    return [{"plan": plan, "run": run} for plan, run in session.execute(query)]
