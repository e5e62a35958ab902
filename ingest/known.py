"""What the store knows of a campaign before an ingest: its recordings, and what its rows said."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ..schema.benches import ModalTable, Plate
from ..schema.campaigns import Campaign, Configuration
from ..schema.configurations import configuration_fingerprint
from ..schema.impacts import Impact
from ..schema.recordings import Recording
from ..schema.shots import Shot
from .errors import IngestError
from .modes import ModalTableFile
from .runs import RunRow
from .velocity import muzzle_velocity_uncertainty


@dataclass(frozen=True)
class KnownRecording:
    """A row of the store's recordings."""

    sha256: str
    status: str
    reason: str | None


@dataclass(frozen=True)
class KnownRow:
    """A row of `runs.csv` that is in the store: its recording's path, and what else it said."""

    recording: str | None
    content: tuple[object, ...]


def known_recordings(session: Session, campaign: Campaign | None) -> dict[str, KnownRecording]:
    """By path."""
    if campaign is None:
        return {}
    columns = (Recording.path, Recording.sha256, Recording.status, Recording.reason)
    rows = session.execute(select(*columns).where(Recording.campaign_id == campaign.id))
    return {path: KnownRecording(sha256, status, reason) for path, sha256, status, reason in rows}


def known_rows(session: Session, campaign: Campaign | None) -> dict[tuple[int, int], KnownRow]:
    """(run, repetition) -> what the table said of it."""
    if campaign is None:
        return {}
    # a gun's hit is impact and shot, and the shot has the say
    table: type[Impact] | type[Shot] = Shot if campaign.kind == "gun" else Impact
    values: tuple[Any, ...] = (
        (Shot.measured_velocity_m_s, Shot.measured_velocity_u_m_s, Shot.bullet_length_m)
        if table is Shot
        else (Impact.impact_velocity_m_s, Impact.impact_velocity_u_m_s)
    )
    query = (
        select(table.run, table.repetition, Recording.path, Configuration.fingerprint, table.velocity_source, *values)
        .join(Configuration, table.configuration_id == Configuration.id)
        .outerjoin(Recording, table.recording_id == Recording.id)
        .where(table.campaign_id == campaign.id)
    )
    known: dict[tuple[int, int], KnownRow] = {}
    for run, repetition, path, fingerprint, source, speed, speed_u, *bullet in session.execute(query):
        reported = (speed, speed_u) if source == "reported" else (None, None)
        known[run, repetition] = KnownRow(path, (fingerprint, *reported, *bullet))
    return known


def row_content(row: RunRow, kind: str) -> tuple[object, ...]:
    """What `known_rows` finds where the store has this very row."""
    fingerprint = configuration_fingerprint(row.levels)
    if kind == "gun":
        speed = row.measured_velocity_m_s
        return (fingerprint, speed, None if speed is None else reported_uncertainty(row), row.bullet_length_m)
    speed = row.impact_velocity_m_s
    return (fingerprint, speed, None if speed is None else row.impact_velocity_u_m_s)


def refuse_other_modes(session: Session, campaign: Campaign, modes: ModalTableFile | None) -> None:
    """Raise `IngestError` when the stored campaign's plate has another modal table than `modes`."""
    query = select(ModalTable.fingerprint).join(Plate, Plate.modal_table_id == ModalTable.id)
    known = session.scalar(query.where(Plate.id == campaign.plate_id))
    if modes is not None and known != modes.fingerprint:
        raise IngestError(
            f"campaign.toml: campaign {campaign.name!r} is in the store with another modal table; "
            "give this one another name"
        )


def reported_uncertainty(row: RunRow) -> float | None:
    """The lab's own standard uncertainty; else eq. 5.2 where bullet length and laser sampling rate are given."""
    if row.measured_velocity_u_m_s is not None or not row.measured_velocity_m_s:
        return row.measured_velocity_u_m_s
    if row.bullet_length_m is None or row.laser_sampling_rate_hz is None:
        return None
    transit = row.bullet_length_m / row.measured_velocity_m_s
    length_u = {} if row.bullet_length_u_m is None else {"length_u_m": row.bullet_length_u_m}
    period = 1.0 / row.laser_sampling_rate_hz
    return float(muzzle_velocity_uncertainty(row.bullet_length_m, transit, time_u_s=period, **length_u))
