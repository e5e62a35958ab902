"""A campaign moved out of the store into a file, and back."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ....schema.conditions import has_campaign
from ....schema.diagnoses import Diagnosis, TwinVersion
from ....schema.provenance import CAMPAIGN, Tombstone
from ....schema.removal.part import Part, campaign_part
from ....schema.removal.removing import attached_hash, content_hash
from ....schema.removal.returning import restore_references
from ....schema.rows import Progress
from ....schema.session import Store
from ....schema.transfer.export import Archive, archive_of, opened_file, write_archive
from ....schema.transfer.merging import merge
from ....training.registry.model_storage import storage_for
from .removal import adopted_elsewhere, checked_reason, deletion_lines, models_of, removal_lines


class RestoreRefusedError(ValueError):
    """A file cannot be put back in the place of what was deleted; the message says why and what to
    do."""


def archive_folder(db: str) -> Path:
    """Where this machine keeps archives of the store at `db`: beside the folder of its models."""
    models = storage_for(db, {}).folder
    return models.with_name(models.name.removesuffix("-models") + "-archives").absolute()


def kept_archive(db: str, path: str | None) -> Path | None:
    """The file of a tombstone, where it lies in that folder; another file is never read."""
    if path is None:
        return None
    file = Path(path)
    return (
        file if file.parent.resolve() == archive_folder(db).resolve() and file.is_file() else None
    )


def archived_in(store: Store, out: Path) -> dict[str, Any] | None:
    """The tombstone of the campaign that lies in this file, as `deletion_lines` gives it; None
    where there is none."""
    with store.reading() as session:
        query = select(Tombstone).where(Tombstone.archive_path == str(out.resolve()))
        stone = session.scalars(query).first()
        return None if stone is None else deletion_lines(stone)


def archive_campaign(
    store: Store, url: str, campaign: str, out: Path, reason: str, progress: Progress | None = None
) -> dict[str, Any]:
    """Write the campaign to the new file `out`, read that back, then delete it; its tombstone
    (`deletion_lines`).

    Nothing is deleted unless the file holds what the store holds at that moment. Raises as
    `write_archive` and `delete_campaign`, `RestoreRefusedError` where the campaign changed
    meanwhile.
    """
    words = checked_reason(reason)
    archive = write_archive(store, campaign, out, progress)
    with store.reading() as session:
        part = campaign_part(session, campaign)
    models = models_of(store, url, part)

    def delete(session: Session) -> dict[str, Any]:
        file = (str(archive.path), archive.sha256)
        own_part = campaign_part(session, campaign)
        attached = attached_hash(session, own_part)
        stone = removal_lines(session, own_part, words, models, file)
        if (stone.content_hash, attached) != (archive.content_hash, archive.attached_hash):
            raise RestoreRefusedError(
                f"campaign {campaign!r} changed while it was written to "
                f"{out}: nothing was deleted; name a new file"
            )
        return deletion_lines(stone)

    return store.write(delete)


def restore_campaign(store: Store, file: Path, progress: Progress | None = None) -> dict[str, Any]:
    """Put a deleted campaign back from its file, in one transaction; its tombstone as
    `deletion_lines` gives it.

    Also "added": new rows by table; "returned": pulses that datasets got back, by name; "notes":
    what could not be as before, or changes predictions of other campaigns. Diagnoses come from the
    file, those that it lacks and adopted effects from the tombstone. Raises `ForeignFileError` for
    a file that does not pass its checks, `RestoreRefusedError` where the campaign is in the store
    or no tombstone tells of this content.
    """
    with opened_file(file, progress) as origin:
        archive = archive_of(file, origin)

        def restore(session: Session) -> dict[str, Any]:
            stone = _stone_of(session, archive)
            added = merge(store, session, origin)
            part = campaign_part(session, archive.campaign)
            if content_hash(session, part) != stone.content_hash:
                raise RestoreRefusedError(
                    f"campaign {part.campaign!r} of {file} would not be what "
                    f"was deleted; nothing was stored"
                )
            notes = list(_take_back(session, part, stone))
            returned = restore_references(session, part, store.written_by(session))
            stone.restored_at = datetime.now(UTC)
            session.flush()
            if stone.archive_sha256 not in (None, archive.sha256):
                notes.append(
                    "the file is not byte for byte the one "
                    "that was written, its content is the same"
                )
            return {**deletion_lines(stone), "added": added, "returned": returned, "notes": notes}

        return store.write(restore)


def _stone_of(session: Session, archive: Archive) -> Tombstone:
    """The newest open tombstone of this content."""
    if has_campaign(session, archive.campaign):
        raise RestoreRefusedError(
            f"campaign {archive.campaign!r} is in the store; what "
            f"{archive.path} has beyond it: pyroshock db import"
        )
    query = select(Tombstone).where(
        Tombstone.kind == CAMPAIGN, Tombstone.campaign == archive.campaign
    )
    stones = session.scalars(query.order_by(Tombstone.id.desc()).with_for_update()).all()
    for stone in stones:
        if stone.content_hash == archive.content_hash and stone.restored_at is None:
            return stone
    what = (
        "no campaign of this name was deleted"
        if not stones
        else "what was deleted under this name had other content"
    )
    raise RestoreRefusedError(
        f"{archive.path} holds campaign {archive.campaign!r} with content "
        f"{archive.content_hash[:12]}: {what}; to add it as a new one: pyroshock db import"
    )


def _take_back(session: Session, part: Part, stone: Tombstone) -> Iterator[str]:
    """Diagnoses that the file lacks, and adopted effects, from the tombstone; what could not be as
    before."""
    before = adopted_elsewhere(session, part)
    keys = _diagnoses(session, part, stone.stood_on["diagnoses"])
    for entry in stone.stood_on["adopted"]:
        version = int(entry["version"])
        if session.scalar(select(TwinVersion.id).where(TwinVersion.version == version)) is not None:
            yield (
                f"version {version} of the twin ({entry['reason']}) was not "
                f"restored, for another has its number now; "
                f"to adopt it again: pyroshock diagnose {part.campaign} --adopt EFFECT"
            )
            continue
        session.add(
            TwinVersion(
                version=version,
                campaign_id=part.campaign_id,
                diagnosis_id=keys.get(entry.get("diagnosis")),
                adopted_at=datetime.fromisoformat(entry["adopted_at"]),
                reason=entry["reason"],
                configuration=entry["configuration"],
            )
        )
    session.flush()
    after = adopted_elsewhere(session, part)
    for name, effects in before.items():
        if effects != after[name]:
            yield (
                f"predictions of campaign {name!r} take up again what was adopted "
                f"from {part.campaign!r}"
            )


def _diagnoses(
    session: Session, part: Part, entries: Sequence[dict[str, Any]]
) -> dict[int | None, int]:
    """Keys of the diagnoses in the store by those that they had; what is not there is added from
    its report."""
    rows = session.scalars(select(Diagnosis).where(Diagnosis.campaign_id == part.campaign_id))
    there = {(row.simulator, row.diagnosed_at.replace(microsecond=0)): row.id for row in rows}
    keys: dict[int | None, int] = {}
    for entry in entries:
        diagnosed_at = datetime.fromisoformat(entry["diagnosed_at"])
        identity = (
            entry["simulator"],
            diagnosed_at.replace(microsecond=0),
        )  # older tombstones have seconds
        if identity not in there:
            row = Diagnosis(
                campaign_id=part.campaign_id,
                simulator=entry["simulator"],
                diagnosed_at=diagnosed_at,
                report=entry["report"],
            )
            session.add(row)
            session.flush()
            there[identity] = row.id
        keys[entry["id"]] = there[identity]
    return keys
