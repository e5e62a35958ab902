"""From a pulse of a dataset back to the raw file that it was cut from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ..schema.campaigns import Campaign
from ..schema.impacts import DatasetSnapshot, ExtractionSettingsRow, Impact, Pulse, SnapshotPulse
from ..schema.recordings import Recording
from .snapshot import Snapshot

_SHORTEST_KEY = 4


@dataclass(frozen=True)
class Trace:
    """Where a pulse came from. `start_s` and `end_s` bound the contact on the recording's clock."""

    key: str
    campaign: str
    run: int
    repetition: int
    recording: str
    recording_sha256: str
    extraction: str
    extraction_version: int
    extraction_settings: dict[str, Any]
    start_s: float
    end_s: float
    pulse_id: int
    impact_id: int


def trace(session: Session, snapshot: Snapshot, key: str) -> Trace:
    """The origin of a pulse by its key, or the start of it. Raises `LookupError` where none or several have it."""
    matches = [row for row, text in enumerate(snapshot.table.key) if len(key) >= _SHORTEST_KEY and text.startswith(key)]
    if len(matches) != 1:
        raise LookupError(
            f"{len(matches) or 'no'} pulses of dataset {snapshot.name!r} have the key {key!r}; "
            f"expected the start of one, such as {str(snapshot.table.key[0])[:12]}; "
            f"pyroshock dataset export {snapshot.name} --out FILE.csv lists them"
        )
    row = matches[0]
    query = (
        select(Campaign, Impact, Pulse, ExtractionSettingsRow, Recording)
        .select_from(Pulse)
        .join(Impact, Pulse.impact_id == Impact.id)
        .join(Campaign, Impact.campaign_id == Campaign.id)
        .join(ExtractionSettingsRow, Pulse.settings_id == ExtractionSettingsRow.id)
        .join(Recording, Impact.recording_id == Recording.id)
        .where(Pulse.id == int(snapshot.table.pulse_id[row]))
    )
    campaign, impact, pulse, settings, recording = session.execute(query).one()
    return Trace(
        key=str(snapshot.table.key[row]),
        campaign=campaign.name,
        run=impact.run,
        repetition=impact.repetition,
        recording=recording.path,
        recording_sha256=recording.sha256,
        extraction=settings.fingerprint,
        extraction_version=settings.code_version,
        extraction_settings=settings.settings,
        start_s=pulse.start_s,
        end_s=pulse.start_s + pulse.contact_time_s,
        pulse_id=pulse.id,
        impact_id=impact.id,
    )


def raw_files(session: Session, snapshot: Snapshot) -> list[dict[str, Any]]:
    """Every recording that pulses of a dataset were cut from: campaign, path, SHA-256, how many pulses."""
    query = (
        select(Campaign.name, Recording.path, Recording.sha256, func.count())
        .select_from(SnapshotPulse)
        .join(DatasetSnapshot, SnapshotPulse.snapshot_id == DatasetSnapshot.id)
        .join(Pulse, SnapshotPulse.pulse_id == Pulse.id)
        .join(Impact, Pulse.impact_id == Impact.id)
        .join(Campaign, Impact.campaign_id == Campaign.id)
        .join(Recording, Impact.recording_id == Recording.id)
        .where(DatasetSnapshot.content_hash == snapshot.hash)
        .group_by(Campaign.name, Recording.path, Recording.sha256)
    )
    keys = ("campaign", "recording", "sha256", "pulses")
    return [dict(zip(keys, row, strict=True)) for row in sorted(session.execute(query).all())]
