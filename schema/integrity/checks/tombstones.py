"""Tombstones say what is so: what they call discarded is gone, what they call restored or replaced
is there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from sqlalchemy import Connection, select

from ...campaigns import Campaign
from ...provenance import CAMPAIGN, Tombstone
from ...recordings import Recording
from ..findings import RESTORE, IntegrityFinding, Scope

_COLUMNS = (
    Tombstone.id,
    Tombstone.kind,
    Tombstone.campaign,
    Tombstone.recording,
    Tombstone.file_sha256,
    Tombstone.replaced_by,
    Tombstone.restored_at,
)
_AGAIN = (
    "take it out again (pyroshock runs discard), or restore the store from its "
    "backup (docs/reference/store.md)"
)

#: The files of each campaign that is in the store, as path and SHA-256.
_Files = Mapping[str, set[tuple[str, str]]]


def check_tombstones(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Discarded recordings that are in the store all the same, and restored or replacing ones that
    are not.

    What a later tombstone says of the same campaign or file goes before what an earlier one says.
    """
    stones = connection.execute(select(*_COLUMNS).order_by(Tombstone.id)).all()
    if not stones:
        return
    files = _files(connection, {stone.campaign for stone in stones})
    for number, stone in enumerate(stones):
        later = [
            tombstone for tombstone in stones[number + 1 :] if tombstone.campaign == stone.campaign
        ]
        wrong = _wrong(stone, later, files.get(stone.campaign))
        if wrong is not None:
            place = {
                "campaign": stone.campaign,
                "recording": stone.recording,
                "table": "tombstones",
                "row": stone.id,
            }
            given = {key: value for key, value in place.items() if value is not None}
            yield IntegrityFinding("tombstones", *wrong, given)


def _files(connection: Connection, names: set[str]) -> _Files:
    files: dict[str, set[tuple[str, str]]] = {
        name: set()
        for name in connection.scalars(select(Campaign.name).where(Campaign.name.in_(names)))
    }
    query = select(Campaign.name, Recording.path, Recording.sha256)
    query = query.join(Recording, Recording.campaign_id == Campaign.id).where(
        Campaign.name.in_(names)
    )
    for name, path, sha256 in connection.execute(query):
        files[name].add((path, sha256))
    return files


def _wrong(
    stone: Any, later: Sequence[Any], there: set[tuple[str, str]] | None
) -> tuple[str, str] | None:
    """What is wrong with a tombstone, and the advice; `there` are the campaign's files, None where
    it is not there."""
    if any(tombstone.kind == CAMPAIGN for tombstone in later):
        return None
    files = there or set()
    if stone.kind == CAMPAIGN:
        if stone.restored_at is not None and there is None:
            return (
                "the campaign was restored by what its tombstone says, and is not in the store",
                RESTORE,
            )
    elif stone.replaced_by is not None:
        gone = any(tombstone.file_sha256 == stone.replaced_by for tombstone in later)
        if not gone and stone.replaced_by not in {sha256 for _, sha256 in files}:
            return "the recording was replaced by a file that is not in the store", RESTORE
    elif not any(tombstone.recording == stone.recording for tombstone in later):
        present = any(
            path == stone.recording and stone.file_sha256 in (None, sha256)
            for path, sha256 in files
        )
        if stone.restored_at is not None and not present:
            return (
                "the recording was stored again by what "
                "its tombstone says, and is not in the store",
                RESTORE,
            )
        if stone.restored_at is None and present:
            return "the recording was discarded, and is in the store all the same", _AGAIN
    return None
