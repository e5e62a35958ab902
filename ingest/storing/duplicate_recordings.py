"""Recordings that are stored twice: the same samples within a campaign, or the same file in
another."""

from __future__ import annotations

from sqlalchemy import Connection, bindparam, func, select

from ...schema.campaigns import Campaign
from ...schema.recordings import STORED, RecordedChannel, Recording
from ...signals.checks.base import Finding

_of_campaign = Recording.campaign_id == bindparam("campaign")
_own = RecordedChannel.recording_id == bindparam("recording")
#: Recordings of a campaign that have the samples of all channels of one of them, by path.
_ALIKE = (
    select(Recording.path)
    .join(RecordedChannel, RecordedChannel.recording_id == Recording.id)
    .where(RecordedChannel.sha256.in_(select(RecordedChannel.sha256).where(_own)))
    .where(_of_campaign, Recording.id != bindparam("recording"))
    .group_by(Recording.path)
    .having(
        func.count(RecordedChannel.id)
        >= select(func.count(RecordedChannel.id)).where(_own).scalar_subquery()
    )
    .order_by(Recording.path)
)
#: Campaign and path of the stored recordings of other campaigns that are the same file.
_ELSEWHERE = (
    select(Campaign.name, Recording.path)
    .join(Campaign, Recording.campaign_id == Campaign.id)
    .where(Recording.sha256 == bindparam("sha256"), ~_of_campaign, Recording.status == STORED)
    .order_by(Campaign.name, Recording.path)
)


def check_same_samples(
    connection: Connection, campaign: int, recording: int, channel: str
) -> Finding | None:
    """A recording whose samples are those of other recordings of its campaign; both by their
    key."""
    keys = {"campaign": campaign, "recording": recording}
    twins = list(connection.scalars(_ALIKE, keys))
    if not twins:
        return None
    message = (
        f"holds the same samples as {twins[0]}: one recording stands for two "
        f"runs; look which run it is of"
    )
    return Finding("same-recording", "warning", message, channel, {"same_as": twins})


def check_other_campaigns(
    connection: Connection, campaign: int, sha256: str, channel: str
) -> Finding | None:
    """A recording whose file, known by its SHA-256, is stored in other campaigns than its own,
    too."""
    places = connection.execute(_ELSEWHERE, {"campaign": campaign, "sha256": sha256}).all()
    if not places:
        return None
    other, path = places[0]
    more = f" and {len(places) - 1} more" if len(places) > 1 else ""
    message = (
        f"this very file is stored as {path} of campaign {other}{more}: datasets of both would "
        "hold its impacts twice; delete one of the campaigns, or build datasets of one of them"
    )
    evidence = {"stored_as": [{"campaign": name, "recording": place} for name, place in places]}
    return Finding("same-recording", "warning", message, channel, evidence)
