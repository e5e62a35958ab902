"""Discarded recordings are kept in a file until they are restored: a discard can be undone."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from uuid import uuid4

from ....schema.provenance import RECORDING, Tombstone
from ....schema.rehearsal import RolledBackStore
from ....schema.removal.part import Part
from ....schema.removal.removing import content_hash
from ....schema.session import Store
from ....schema.transfer.export import export_recording
from ....schema.transfer.merging import import_file
from ....training.registry.model_storage import storage_for


def discarded_file(db: str, digest: str) -> Path:
    """Where this machine keeps a discarded recording of the store at `db`: beside its archives."""
    models = storage_for(db, {}).folder
    archives = models.with_name(models.name.removesuffix("-models") + "-archives").absolute()
    return archives / "discarded" / f"{digest}.pyroshock"


def keep_recording(store: Store, db: str, part: Part) -> None:
    """Write a recording that is about to be discarded to its file; a rehearsal writes none.

    Parameters:
        store: The open store.
        db: Its address.
        part: The recording.

    Raises:
        OSError: Where the file cannot be written; nothing was discarded then.
    """
    if isinstance(store, RolledBackStore):
        return
    with store.reading() as session:
        digest = content_hash(session, part)
    file = discarded_file(db, digest)
    # Two may discard the same recording at once: each writes a file of its own, and both are alike.
    own = file.with_name(f"{file.name}.{uuid4().hex}")
    try:
        export_recording(store, part, own)
        own.replace(file)
    finally:
        own.unlink(missing_ok=True)


def can_restore(db: str, stone: dict[str, Any]) -> bool:
    """Whether a discarded recording is kept on this machine, and neither stored again nor replaced.

    Parameters:
        db: The address of the store.
        stone: The tombstone, as `removal.deletion_lines` gives it.
    """
    return (
        stone["kind"] == RECORDING
        and stone["restored_at"] is None
        and stone["replaced_by"] is None
        and discarded_file(db, stone["content_hash"]).is_file()
    )


def restore_recording(store: Store, db: str, key: int) -> dict[str, Any]:
    """Put a discarded recording back from its file, in one transaction; datasets get their pulses
    back.

    Parameters:
        store: The open store.
        db: Its address.
        key: The number of the tombstone.

    Returns:
        The campaign, the recording, and the new rows by table ("added").

    Raises:
        LookupError: Where there is no such tombstone, or its file is not on this machine.
        StoreError: Where the campaign has changed so that the recording no longer fits to it.
    """
    with store.reading() as session:
        row = session.get(Tombstone, key)
        columns = ("kind", "campaign", "recording", "content_hash", "restored_at", "replaced_by")
        stone = None if row is None else {name: getattr(row, name) for name in columns}
    if stone is None or not can_restore(db, stone):
        raise LookupError(
            f"deletion {key} has no recording that is kept on this machine; ingest its folder "
            "again, and name the recording in the field Again"
        )
    file = discarded_file(db, stone["content_hash"])
    report = import_file(store, file)
    file.unlink(missing_ok=True)
    return {
        "campaign": stone["campaign"],
        "recording": stone["recording"],
        "added": dict(report.added),
    }
