"""What is struck while it is taken back: a deletion, archive, restoration, a discarded and a
replaced recording."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pyroshock.app.operations.store.check import findings_of
from pyroshock.schema.provenance import Tombstone
from sqlalchemy import select

from support.records.campaigns import blows, force_record, recording_name, write_recording
from support.stores.hammer_stores import HITS, full_campaign
from support.stores.many_databases import Databases
from support.stores.stores import content, ingested, opened, pyroshock

CAMPAIGN, FIRST = "spring", recording_name(1)
#: Of what is not told of, apart from clocks and addresses.
_TOLD = (
    "kind",
    "campaign",
    "recording",
    "content_hash",
    "reason",
    "counts",
    "file_sha256",
    "replaced_by",
)


@dataclass
class UndonePlace:
    """A store with a campaign and a dataset of it, and one command that takes something back.

    `before` and `after` are the two states that a kill may leave.
    """

    url: str
    command: Sequence[str]
    folder: Path
    before: object
    after: object = None
    environment: Mapping[str, str] = field(default_factory=dict)

    def look(self) -> None:
        with opened(self.url) as store:
            assert list(findings_of(store, self.url)) == []
        state = state_of(self.url)
        assert state in (self.before, self.after), "neither before nor after"

    def is_done(self) -> bool:
        """Whether the command has nothing left to do."""
        return state_of(self.url) == self.after

    def content(self) -> object:
        return state_of(self.url)


def state_of(url: str) -> object:
    """Every row apart from keys and clocks."""
    rows = {name: digests for name, digests in content(url).items() if name != "tombstones"}
    with opened(url) as store, store.reading() as session:
        stones = [
            [getattr(stone, name) for name in _TOLD]
            + [stone.restored_at is not None, stone.stood_on["datasets"]]
            for stone in session.scalars(select(Tombstone).order_by(Tombstone.id))
        ]
    return rows, stones


#: Of each operation the words of its command; FILE is the archive's, FOLDER the corrected
#: campaign's.
COMMANDS = {
    "campaigns delete": f"campaigns delete {CAMPAIGN}",
    "campaigns archive": f"campaigns archive {CAMPAIGN} --out FILE",
    "campaigns restore": "campaigns restore FILE",
    "runs discard": f"runs discard {CAMPAIGN} {FIRST}",
    "runs replace": f"runs replace {CAMPAIGN} {FIRST} --from FOLDER",
}


def undone_places(
    operation: str, databases: Databases, folder: Path
) -> Callable[[str], UndonePlace]:
    """The same store for all, of four recordings with five hits each."""
    folder.mkdir(parents=True, exist_ok=True)
    base, corrected, archive = databases.empty(), folder / "corrected", folder / "kept.pyroshock"
    ingested(base, full_campaign(folder / CAMPAIGN))
    _done("dataset", "build", "small", "--from", CAMPAIGN, "--db", base)
    shutil.copytree(folder / CAMPAIGN, corrected)
    write_recording(
        corrected / FIRST, {"force": force_record(blows(1, HITS), np.random.default_rng(99))}
    )
    if operation == "campaigns restore":
        _done("campaigns", "archive", CAMPAIGN, "--out", archive, "--reason", "r", "--db", base)
    before = state_of(base)

    def make(name: str) -> UndonePlace:
        place = folder / name
        place.mkdir()
        file = place / archive.name
        if archive.exists():
            shutil.copyfile(archive, file)
        words = [
            {"FILE": str(file), "FOLDER": str(corrected)}.get(word, word)
            for word in COMMANDS[operation].split()
        ]
        reason = [] if operation == "campaigns restore" else ["--reason", "struck"]
        url = databases.copy(base)
        return UndonePlace(url, (*words, *reason, "--db", url), place, before)

    whole = make("whole")
    _done(*whole.command)
    after = state_of(whole.url)
    assert after != before

    def ready(name: str) -> UndonePlace:
        place = make(name)
        place.after = after
        return place

    return ready


def _done(*words: str | Path) -> None:
    result = pyroshock(*words)
    assert result.exit_code == 0, result.stderr
