"""One stored recording replaced from its campaign folder: by a corrected row, another file, or
both."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.campaigns import Campaign
from ...schema.provenance import Tombstone
from ...schema.rehearsal import RolledBackStore
from ...schema.removal.part import Part, recording_part
from ...schema.removal.returning import restore_references
from ...schema.session import Store
from ..errors import IngestError
from ..extraction.derived_force import campaign_plate_response
from ..extraction.recording import ExtractedRecording, UnreadableRecording, extract_or_exclude
from ..extraction.row_plausibility import compare_with_rows
from ..extraction.settings import ExtractionSettings
from ..folder.campaign_file import FILE as CAMPAIGN
from ..folder.campaign_file import CampaignFile
from ..folder.campaign_tables import NamedRecording, read_campaign_tables
from ..folder.runs_table import FILE, RunRow
from .campaign_writer import CampaignWriter
from .row_changes import RowDifferences
from .stored_rows import StoredRow, stored_recordings, stored_rows


@dataclass(frozen=True)
class Replacement:
    """What is to be stored in the place of a recording: read, judged and cut, and not yet
    written."""

    store: Store
    campaign: str
    old: str
    new: ExtractedRecording
    writer: CampaignWriter

    def part(self, session: Session) -> Part:
        """What goes. Raises `LookupError` where it is no longer there."""
        return recording_part(session, self.campaign, self.old)

    def write(self, session: Session, stone: Tombstone) -> dict[str, int]:
        """Store the new recording in the transaction that has taken the old one out and left
        `stone`.

        Datasets get the pulses of earlier deletions back where all of their content agrees: how
        many, by name.
        """
        stone.replaced_by = self.new.sha256
        self.writer.make_room(session, self.new)
        self.writer.write(session, self.new)
        session.flush()
        return restore_references(
            session, recording_part(session, self.campaign, self.new.path),
            self.store.written_by(session)
        )  # fmt: skip


def prepared_replacement(
    store: Store,
    campaign: str,
    old: str,
    folder: Path,
    path: str | None = None,
    settings: ExtractionSettings | None = None,
    *,
    free_factors: Collection[str] = (),
    confirmed: Collection[str] = (),
) -> Replacement:
    """Read what replaces recording `old`: the file of that path in `folder`, or of another `path`,
    with its rows.

    Other recordings of the folder are not looked at. Raises `LookupError` for what is not in the
    store, `IngestError` where the folder is another campaign's, no row names the recording, the
    file cannot be read, nothing has changed, or as an ingest of it would; nothing is written.
    """
    settings, path = settings or ExtractionSettings(), path or old
    with store.reading() as session:
        recording_part(session, campaign, old)
    tables = read_campaign_tables(store, folder, free_factors, confirmed)
    file = tables.file
    if file.name != campaign:
        raise IngestError(
            f"{CAMPAIGN}: campaign.name is {file.name!r}; expected "
            f"{campaign!r}, whose recording goes"
        )
    own_rows = tuple(row for row in tables.rows if row.recording == path)
    if not own_rows:
        raise IngestError(
            f"no row of {FILE} names recording {path!r}; add its rows, or "
            f"discard: pyroshock runs discard"
        )
    named = tables.recording(path, own_rows)
    store.read(lambda session: _refuse_unchanged(session, file, old, named))
    own_tables = replace(tables, rows=own_rows)
    writer = CampaignWriter(store, own_tables, settings, again=(path,), replaced=old)
    if writer.has_recording(path, named.sha256):
        raise IngestError(
            f"recording {path!r} is in the store as it is; replace it by "
            f"another, or discard {old!r} alone"
        )
    new = extract_or_exclude(tables, settings, campaign_plate_response(tables), named)
    if isinstance(new, UnreadableRecording):
        raise IngestError(f"{path}: {new.reason}; recording {old!r} stays in the store")
    new = compare_with_rows(tables, new)
    new = new.without_samples() if isinstance(store, RolledBackStore) else new
    return Replacement(store, campaign, old, new, writer)


def _refuse_unchanged(
    session: Session, file: CampaignFile, old: str, named: NamedRecording
) -> None:
    """Raise `IngestError` where file and rows are those that are stored."""
    campaign = session.scalars(select(Campaign).where(Campaign.name == file.name)).one()
    if named.path != old or stored_recordings(session, campaign)[old].sha256 != named.sha256:
        return
    stored = {
        number: row
        for number, row in stored_rows(session, campaign).items()
        if row.recording == old
    }
    if any(_differs(session, file, row, stored) for row in named.rows) or not _counted(
        named.rows, stored
    ):
        return
    raise IngestError(
        f"recording {old!r}: its file and its rows of {FILE} are those in the "
        f"store; nothing to replace"
    )


def _differs(
    session: Session, file: CampaignFile, row: RunRow, stored: dict[tuple[int, int], StoredRow]
) -> bool:
    stored_impact = stored.get((row.run, row.repetition))
    if stored_impact is None:
        return True
    differences = RowDifferences(file.kind)
    return bool(
        differences.changes(session, row, stored_impact)
        or differences.added_factors(session, row, stored_impact)
    )


def _counted(rows: Sequence[RunRow], stored: Collection[tuple[int, int]]) -> bool:
    """Whether the rows stand for all stored hits: each for its own, or one for the repetitions of
    its run."""
    return len(rows) == len(stored) or (
        len(rows) == 1 and {run for run, _ in stored} == {rows[0].run}
    )
