"""Recordings that are stored twice: the same samples within a campaign, or the same file in
another."""

from __future__ import annotations

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ...schema.campaigns import Campaign
from ...schema.recordings import STORED, RecordedChannel, Recording
from ...signals.checks.base import Finding


def check_same_samples(session: Session, recording: Recording, channel: str) -> Finding | None:
    """A recording whose samples are those of other recordings of its campaign."""
    twins = _recordings_alike(session, recording)
    if not twins:
        return None
    message = (
        f"holds the same samples as {twins[0]}: one recording stands for two "
        f"runs; look which run it is of"
    )
    return Finding("same-recording", "warning", message, channel, {"same_as": twins})


def check_other_campaigns(session: Session, recording: Recording, channel: str) -> Finding | None:
    """A recording whose file is stored in other campaigns, too."""
    places = _stored_elsewhere(session, recording)
    if not places:
        return None
    campaign, path = places[0]
    more = f" and {len(places) - 1} more" if len(places) > 1 else ""
    message = (
        f"this very file is stored as {path} of campaign {campaign}{more}: datasets of both would "
        "hold its impacts twice; delete one of the campaigns, or build datasets of one of them"
    )
    evidence = {"stored_as": [{"campaign": name, "recording": place} for name, place in places]}
    return Finding("same-recording", "warning", message, channel, evidence)


def _recordings_alike(session: Session, recording: Recording) -> list[str]:
    """Other recordings of the same campaign with the same samples on every channel, by path."""
    own = select(RecordedChannel.sha256).where(RecordedChannel.recording_id == recording.id)
    number = select(func.count(RecordedChannel.id)).where(
        RecordedChannel.recording_id == recording.id
    )
    query = (
        select(Recording.path)
        .join(RecordedChannel, RecordedChannel.recording_id == Recording.id)
        .where(RecordedChannel.sha256.in_(own))
        .where(Recording.campaign_id == recording.campaign_id, Recording.id != recording.id)
        .group_by(Recording.path)
        .having(func.count(RecordedChannel.id) >= number.scalar_subquery())
        .order_by(Recording.path)
    )
    return list(session.scalars(query))


def _stored_elsewhere(session: Session, recording: Recording) -> list[tuple[str, str]]:
    """(campaign, path) of stored recordings of other campaigns that are the same file."""
    query = (
        select(Campaign.name, Recording.path)
        .join(Campaign, Recording.campaign_id == Campaign.id)
        .where(
            Recording.sha256 == recording.sha256,
            Recording.campaign_id != recording.campaign_id,
            Recording.status == STORED,
        )
        .order_by(Campaign.name, Recording.path)
    )
    return [(name, path) for name, path in session.execute(query)]
