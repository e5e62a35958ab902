"""The recordings, impacts and shots of a campaign that are in the store already."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.campaigns import Campaign, Configuration
from ...schema.impacts import Impact, Shot
from ...schema.recordings import Recording


@dataclass(frozen=True)
class RecordingState:
    """A row of the store's recordings."""

    sha256: str
    status: str
    reason: str | None


@dataclass(frozen=True)
class StoredRow:
    """A row of `runs.csv` that is in the store: its recording's path, the fingerprint of its
    factors, and the values that it reported, by column."""

    recording: str | None
    factors: str
    values: Mapping[str, float | None]


def stored_recordings(session: Session, campaign: Campaign | None) -> dict[str, RecordingState]:
    """By path."""
    if campaign is None:
        return {}
    columns = (Recording.path, Recording.sha256, Recording.status, Recording.reason)
    rows = session.execute(select(*columns).where(Recording.campaign_id == campaign.id))
    return {path: RecordingState(sha256, status, reason) for path, sha256, status, reason in rows}


def stored_rows(session: Session, campaign: Campaign | None) -> dict[tuple[int, int], StoredRow]:
    """(run, repetition) -> what the table said of it."""
    if campaign is None:
        return {}
    # a gun's hit is impact and shot, and the shot has the say
    if campaign.kind == "gun":
        return dict(_stored_shots(session, campaign))
    return dict(_stored_impacts(session, campaign))


def _stored_impacts(
    session: Session, campaign: Campaign
) -> Iterator[tuple[tuple[int, int], StoredRow]]:
    columns = (
        Impact.run,
        Impact.repetition,
        Recording.path,
        Configuration.fingerprint,
        *_IMPACT_VELOCITY,
    )
    query = select(*columns).join(Configuration, Impact.configuration_id == Configuration.id)
    query = query.outerjoin(Recording, Impact.recording_id == Recording.id)
    rows = session.execute(query.where(Impact.campaign_id == campaign.id))
    for run, repetition, path, factors, source, speed, speed_u in rows:
        yield (
            (run, repetition),
            StoredRow(path, factors, reported_velocity("impact", source, speed, speed_u)),
        )


def _stored_shots(
    session: Session, campaign: Campaign
) -> Iterator[tuple[tuple[int, int], StoredRow]]:
    measured = (Shot.velocity_source, Shot.measured_velocity_m_s, Shot.measured_velocity_u_m_s)
    columns = (
        Shot.run,
        Shot.repetition,
        Recording.path,
        Configuration.fingerprint,
        Shot.bullet_length_m,
        *measured,
    )
    query = select(*columns, *_IMPACT_VELOCITY).join(
        Configuration, Shot.configuration_id == Configuration.id
    )
    query = query.outerjoin(Recording, Shot.recording_id == Recording.id).outerjoin(
        Impact, Shot.impact_id == Impact.id
    )
    for run, repetition, path, factors, length, *speeds in session.execute(
        query.where(Shot.campaign_id == campaign.id)
    ):
        values = (
            reported_velocity("measured", *speeds[:3])
            | reported_velocity("impact", *speeds[3:])
            | {"bullet_length_m": length}
        )
        yield (run, repetition), StoredRow(path, factors, values)


_IMPACT_VELOCITY = (
    Impact.velocity_source,
    Impact.impact_velocity_m_s,
    Impact.impact_velocity_u_m_s,
)


def reported_velocity(
    what: str, source: str | None, speed: float | None, speed_u: float | None
) -> dict[str, float | None]:
    """A velocity and its uncertainty where the laboratory reported them; what a record gave is no
    word of a row."""
    names = (f"{what}_velocity_m_s", f"{what}_velocity_u_m_s")
    return dict(zip(names, (speed, speed_u) if source == "reported" else (None, None), strict=True))
