"""What was taken out and is stored again: datasets get their pulses back, and tombstones say so."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import and_, select
from sqlalchemy.orm import Session

from ..campaigns import Campaign, Configuration
from ..impacts import DatasetSnapshot, ExtractionSettingsRow, Impact, Pulse, Shot, SnapshotPulse
from ..provenance import RECORDING, Tombstone
from ..recordings import STORED, Recording
from .content import figures_hashes
from .part import Part


def pulse_digests(session: Session, part: Part, snapshot: int | None = None) -> dict[int, str]:
    """A digest of each pulse of the part by its key, of those in one snapshot or of all: equal for
    equal content.

    It is of the campaign's facts, the file, the hit with its factors and figures, the extraction
    and the pulse's figures: all that a dataset takes from a pulse.
    """
    shot = and_(
        Shot.campaign_id == Impact.campaign_id,
        Shot.run == Impact.run,
        Shot.repetition == Impact.repetition,
    )
    query = (
        select(
            Pulse.id,
            Campaign.fingerprint,
            Recording.sha256,
            Impact.run,
            Impact.repetition,
            Configuration.fingerprint,
            Impact.id,
            Shot.id,
            ExtractionSettingsRow.fingerprint,
        )
        .join(Impact, Pulse.impact_id == Impact.id)
        .join(Campaign, Impact.campaign_id == Campaign.id)
        .join(Configuration, Impact.configuration_id == Configuration.id)
        .join(ExtractionSettingsRow, Pulse.settings_id == ExtractionSettingsRow.id)
        .outerjoin(Recording, Impact.recording_id == Recording.id)
        .outerjoin(Shot, shot)
        .where(Pulse.id.in_(part.pulses))
    )
    if snapshot is not None:
        query = query.join(SnapshotPulse, SnapshotPulse.pulse_id == Pulse.id)
        query = query.where(SnapshotPulse.snapshot_id == snapshot)
    shots = select(Shot.id).where(Shot.campaign_id == part.campaign_id)
    impact_hashes = figures_hashes(session, Impact, part.impacts)
    shot_hashes = figures_hashes(session, Shot, shots)
    pulse_hashes = figures_hashes(session, Pulse, part.pulses)
    digests = {}
    for row in session.execute(query.order_by(Pulse.id)):
        pulse, *facts, impact_id, shot_id, extraction = row
        hit_hashes = (impact_hashes[impact_id], shot_hashes.get(shot_id))
        content = (*facts, *hit_hashes, extraction, pulse_hashes[pulse])
        digests[pulse] = hashlib.sha256(repr(content).encode()).hexdigest()[:32]
    return digests


def restore_references(session: Session, part: Part, written_by: int) -> dict[str, int]:
    """Give frozen datasets the pulses of the part that a deletion took from them, where all of
    their content agrees.

    How many came back, by the dataset's name; `written_by` is the key of who writes.
    """
    stones = session.scalars(
        select(Tombstone).where(Tombstone.campaign == part.campaign).order_by(Tombstone.id)
    ).all()
    wanted = {
        entry["hash"]
        for stone in stones
        for entry in stone.stood_on["datasets"]
        if _still_lost(entry)
    }
    if not wanted:
        return {}
    keys = {digest: key for key, digest in pulse_digests(session, part).items()}
    returned: dict[str, int] = {}
    for stone in stones:
        stone.stood_on = {
            **stone.stood_on,
            "datasets": [
                _given_back(session, entry, keys, written_by, returned)
                for entry in stone.stood_on["datasets"]
            ],
        }
    session.flush()
    return returned


def _still_lost(entry: dict[str, Any]) -> int:
    return int(entry["pulses"]) - int(entry.get("returned", 0))


def _given_back(
    session: Session,
    entry: dict[str, Any],
    keys: dict[str, int],
    written_by: int,
    returned: dict[str, int],
) -> dict[str, Any]:
    """A tombstone's entry of a dataset, with the pulses counted that it has again."""
    members = [digest for digest in entry.get("members", ()) if digest in keys]
    row = session.scalars(
        select(DatasetSnapshot).where(DatasetSnapshot.content_hash == entry["hash"])
    ).one_or_none()
    if row is None or not members or not _still_lost(entry):
        return entry
    own = set(
        session.scalars(select(SnapshotPulse.pulse_id).where(SnapshotPulse.snapshot_id == row.id))
    )
    lost = [keys[digest] for digest in members if keys[digest] not in own]
    for key in lost:
        session.add(SnapshotPulse(snapshot_id=row.id, pulse_id=key, written_by_id=written_by))
    if lost:
        returned[row.name] = returned.get(row.name, 0) + len(lost)
    return {
        **entry,
        "returned": min(int(entry["pulses"]), int(entry.get("returned", 0)) + len(lost)),
    }


def mark_restored(session: Session, content_hash: str) -> None:
    """Tombstones say that the dataset of this content has all of its pulses again."""
    for stone in session.scalars(select(Tombstone)):
        entries = stone.stood_on["datasets"]
        if any(entry["hash"] == content_hash and _still_lost(entry) for entry in entries):
            whole = [
                {**entry, "returned": entry["pulses"]} if entry["hash"] == content_hash else entry
                for entry in entries
            ]
            stone.stood_on = {**stone.stood_on, "datasets": whole}


def open_tombstones(
    session: Session, campaign: str, path: str | None = None
) -> Sequence[Tombstone]:
    """Tombstones of recordings of a campaign that are neither stored again nor replaced, the oldest
    first."""
    query = select(Tombstone).where(
        Tombstone.kind == RECORDING,
        Tombstone.campaign == campaign,
        Tombstone.restored_at.is_(None),
        Tombstone.replaced_by.is_(None),
    )
    if path is not None:
        query = query.where(Tombstone.recording == path)
    return session.scalars(query.order_by(Tombstone.id)).all()


def settle(session: Session, part: Part, sha256: str, written_by: int) -> dict[str, int]:
    """Say on the open tombstones of a recording that its file, or another in its place, is stored
    now.

    Gives datasets their pulses back as `restore_references`, and returns what it does.
    """
    for stone in open_tombstones(session, part.campaign, part.recording):
        if stone.file_sha256 in (None, sha256):
            stone.restored_at = datetime.now(UTC)
        else:
            stone.replaced_by = sha256
    return restore_references(session, part, written_by)


def settle_imported(session: Session, written_by: int) -> list[str]:
    """Recordings that were discarded and came back with a file from elsewhere, as "campaign,
    path"."""
    query = (
        select(Tombstone, Recording, Campaign.id)
        .join(Campaign, Campaign.name == Tombstone.campaign)
        .join(
            Recording,
            and_(Recording.campaign_id == Campaign.id, Recording.path == Tombstone.recording),
        )
        .where(
            Tombstone.kind == RECORDING,
            Tombstone.restored_at.is_(None),
            Tombstone.replaced_by.is_(None),
        )
        .where(Recording.status == STORED)
        .order_by(Tombstone.id)
    )
    returned = []
    for stone, recording, campaign in session.execute(query).all():
        settle(
            session,
            Part(campaign, stone.campaign, recording.id, recording.path),
            recording.sha256,
            written_by,
        )
        returned.append(f"{stone.campaign}, {recording.path}")
    return list(dict.fromkeys(returned))
