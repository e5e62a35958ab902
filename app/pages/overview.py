"""What was recorded lately, what needs attention, and what runs: the first page, counted in the
database.

Each entry of the attention list is a sentence with the address of the page where one acts on it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import chain
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from sqlalchemy import func, select
from sqlalchemy.orm import Session, undefer

from ...doe.plans import list_plans
from ...schema.campaigns import Campaign, stated_day
from ...schema.diagnoses import Diagnosis
from ...schema.impacts import DatasetSnapshot, Impact, Pulse, Shot, SnapshotPulse
from ...schema.jobs import DONE, FAILED, RUNNING, WAITING, Job
from ..operations.diagnose.wording import with_labels
from ..operations.ingest.recording_quality import recording_quality
from ..operations.upload_folders import stored_scratch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...training.registry.records import Version

#: Campaigns that are looked at, and entries of each kind that are listed.
RECENT, _LOOKED_AT, _LISTED = 6, 30, 5
#: A failed job is worth attention for so long.
_LATELY = timedelta(days=7)


@dataclass(frozen=True)
class AttentionItem:
    """`sentence` says what is the matter, `action` what the link to `address` is called; `urgent`:
    something is lost or has failed."""

    sentence: str
    address: str
    action: str
    urgent: bool = False


def list_recent_campaigns(session: Session) -> list[dict[str, Any]]:
    """The campaigns that were stored last, with counts and quality in words."""
    query = (
        select(Campaign.id, Campaign.name, Campaign.kind, Campaign.date)
        .order_by(Campaign.id.desc())
        .limit(RECENT)
    )
    campaigns = session.execute(query).all()
    keys = [key for key, *_ in campaigns]
    impacts, shots = (_count_rows(session, table, keys) for table in (Impact, Shot))
    quality = recording_quality(session, keys)
    return [
        {
            "campaign": name,
            "kind": kind,
            "date": stated_day(date) or "not known",
            "impacts": impacts.get(key, 0),
            "shots": shots.get(key, 0),
            "quality": quality[key].words,
        }
        for key, name, kind, date in campaigns
    ]


def _count_rows(
    session: Session, table: type[Impact] | type[Shot], keys: list[int]
) -> dict[int, int]:
    query = (
        select(table.campaign_id, func.count())
        .where(table.campaign_id.in_(keys))
        .group_by(table.campaign_id)
    )
    return dict(iter(session.execute(query)))


def list_attention(
    session: Session, versions: Sequence[Version], now: datetime | None = None
) -> list[AttentionItem]:
    """What somebody should look at, urgent entries first. `versions` are those of the model
    registry."""
    items = chain(
        _failed_jobs(session, now or datetime.now(UTC)),
        _checked_folders(session),
        _poor_recordings(session),
        _drifts(session),
        _half_done_plans(session),
        _old_models(session, versions),
    )
    return sorted(items, key=lambda item: not item.urgent)


def _failed_jobs(session: Session, now: datetime) -> Iterator[AttentionItem]:
    """The last failures that no later job of the same name made good."""
    failed = select(Job).where(Job.state == FAILED).order_by(Job.id.desc()).limit(_LOOKED_AT)
    labels: set[str] = set()
    for job in session.scalars(failed).all():
        ended = (
            job.ended_at
            if job.ended_at is None or job.ended_at.tzinfo
            else job.ended_at.replace(tzinfo=UTC)
        )
        if job.label in labels or (ended is not None and now - ended > _LATELY):
            continue
        labels.add(job.label)
        again = (
            select(Job.id)
            .where(Job.label == job.label, Job.state == DONE, Job.id > job.id)
            .limit(1)
        )
        if session.scalar(again) is None:
            first_line = (job.error or "").partition("\n")[0]
            yield AttentionItem(
                f"“{job.label}” failed: {first_line:.200}", f"/jobs/{job.id}", "See the job", True
            )
        if len(labels) == _LISTED:
            return


def _checked_folders(session: Session) -> Iterator[AttentionItem]:
    """Uploads that were checked and wait for somebody to store them."""
    query = (
        select(Job).options(undefer(Job.arguments)).where(Job.kind == "check", Job.state == DONE)
    )
    for job in session.scalars(query.order_by(Job.id.desc()).limit(_LISTED)):
        scratch = stored_scratch(job.arguments)
        if scratch is not None and scratch.is_dir():
            folder = job.label.removeprefix("Check of ").removeprefix("Check ")
            yield AttentionItem(
                f"Folder {folder} was checked and is not stored yet.",
                f"/ingest/checks/{job.id}",
                "Store or discard it",
            )


def _poor_recordings(session: Session) -> Iterator[AttentionItem]:
    newest = select(Campaign.id, Campaign.name).order_by(Campaign.id.desc()).limit(_LOOKED_AT)
    names: dict[int, str] = dict(iter(session.execute(newest)))
    quality = recording_quality(session, list(names))
    poor = [key for key in names if quality[key].rejected or quality[key].set_aside]
    for key in poor[:_LISTED]:
        words = []
        if count := quality[key].set_aside:
            words.append(
                f"{_counted(count, 'recording')} could not be read and {_verb(count)} set aside"
            )
        if count := quality[key].rejected:
            words.append(
                f"{_counted(count, 'recording')} {_verb(count)} rejected by the quality checks"
            )
        yield AttentionItem(
            f"{names[key]}: {'; '.join(words)}.",
            f"/campaigns/{quote(names[key], safe='')}#quality",
            "See the findings",
        )
    if len(poor) > _LISTED:
        more = len(poor) - _LISTED
        yield AttentionItem(
            f"{more} further campaigns have such recordings.", "/campaigns", "All campaigns"
        )


def _drifts(session: Session) -> Iterator[AttentionItem]:
    """What the newest diagnosis of a campaign says of the order of its runs."""
    drift = Diagnosis.report["where"]["drift"]
    query = select(Diagnosis.id, Campaign.name, drift).join(
        Campaign, Diagnosis.campaign_id == Campaign.id
    )
    names: set[str] = set()
    for key, name, sentences in session.execute(
        query.order_by(Diagnosis.id.desc()).limit(_LOOKED_AT)
    ).all():
        if name in names or len(names) == _LISTED:
            continue
        names.add(name)
        if sentences:
            sentence = f"{name} changes while the campaign goes on: {with_labels(sentences[0])}."
            yield AttentionItem(sentence, f"/diagnoses/{key}", "See the diagnosis")


def _half_done_plans(session: Session) -> Iterator[AttentionItem]:
    open_plans = [
        row for row in list_plans(session) if row["planned"] and (row["done"] or row["repeat"])
    ]
    for row in open_plans[:_LISTED]:
        runs = row["runs"] - row["discarded"]
        repeats = row["repeat"]
        words = (
            f"; {_counted(repeats, 'run')} {'has' if repeats == 1 else 'have'} "
            f"rejected repetitions to record again"
        )
        yield AttentionItem(
            f"Plan {row['name']}: {row['done']} of {runs} runs are done{words if repeats else ''}.",
            f"/plans/{quote(row['name'], safe='')}/sheet",
            "Go on at the run sheet",
        )


def _old_models(session: Session, versions: Sequence[Version]) -> Iterator[AttentionItem]:
    """Models in use, and pulses of the same kind of bench that came after their dataset was
    frozen."""
    for version in versions:
        if version.champion_of is None:
            continue
        query = select(DatasetSnapshot).where(DatasetSnapshot.content_hash == version.dataset.hash)
        snapshot = session.scalars(query).one_or_none()
        if snapshot is None:
            continue
        last = select(func.max(SnapshotPulse.pulse_id)).where(
            SnapshotPulse.snapshot_id == snapshot.id
        )
        campaigns = (
            select(SnapshotPulse.pulse_id).where(SnapshotPulse.snapshot_id == snapshot.id).limit(1)
        )
        kind = session.scalar(
            select(Campaign.kind)
            .join(Impact, Impact.campaign_id == Campaign.id)
            .join(Pulse, Pulse.impact_id == Impact.id)
            .where(Pulse.id.in_(campaigns))
        )
        newer = (
            select(func.count())
            .select_from(Pulse)
            .join(Impact, Pulse.impact_id == Impact.id)
            .join(Campaign, Impact.campaign_id == Campaign.id)
            .where(Pulse.id > last.scalar_subquery(), Pulse.current, Campaign.kind == kind)
        )
        if count := session.scalar(newer):
            yield AttentionItem(
                f"Model {version.label}, which is in use for the "
                f"{version.champion_of}, has not learned from "
                f"{_counted(count, 'pulse')} that came after dataset {snapshot.name} was frozen.",
                f"/models/{quote(version.name, safe='')}/{version.version}",
                "See the model",
            )


def list_running(session: Session) -> list[Job]:
    """Jobs that run or wait, those that run first."""
    running = select(Job).where(Job.state == RUNNING).order_by(Job.id)
    waiting = select(Job).where(Job.state == WAITING).order_by(Job.id).limit(_LISTED)
    return [*session.scalars(running), *session.scalars(waiting)]


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _verb(count: int) -> str:
    return "was" if count == 1 else "were"
