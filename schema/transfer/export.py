"""`pyroshock db export`: one campaign with all that belongs to it, as a store of its own in one
file, which is read back and known by the hash of its content. A file from elsewhere is opened to
read alone, and refused unless it is what we write."""

from __future__ import annotations

import hashlib
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from sqlalchemy import URL, ColumnElement, Connection, create_engine, func, select, text
from sqlalchemy.exc import DBAPIError
from sqlalchemy.orm import Session
from sqlalchemy.pool import NullPool

from .. import migrate
from ..campaign_rows import members, members_of_recording
from ..campaigns import Campaign
from ..engine import StoreError, first_line, make_engine
from ..integrity.checking import Check, checks, iter_findings
from ..integrity.checks.attachments import check_attachments
from ..integrity.checks.cross_table_rules import check_belonging
from ..integrity.checks.engine_rules import check_database, check_references, check_values
from ..integrity.checks.fingerprints import check_fingerprints
from ..integrity.checks.json_columns import check_names
from ..integrity.checks.pulses import check_pulses
from ..integrity.checks.rows import check_rows
from ..integrity.checks.series import check_series
from ..integrity.findings import IntegrityFinding
from ..listings import get_campaign_id
from ..provenance import Provenance
from ..removal.part import Part, campaign_part
from ..removal.removing import attached_hash, content_hash
from ..rows import Progress, ProgressBar, TableDigest, Values, iter_batches, load
from ..session import Store
from ..tables import metadata
from .copying import initialise_store, verify
from .merge_rules import WRITERS


def export_campaign(
    store: Store, campaign: str, out: Path, progress: Progress | None = None
) -> dict[str, int]:
    """Write a campaign to a new file, which appears when it is whole.

    Parameters:
        store: The open store that holds the campaign.
        campaign: The name of the campaign.
        out: The path of the new file.
        progress: Called with (done, total, what), in rows; by default progress is not reported.

    Returns:
        The number of rows that were written, by table.

    Raises:
        LookupError: For an unknown campaign.
        StoreError: Where `out` is there already or the campaign is damaged: nobody could import it.
    """
    if out.exists():
        raise StoreError(f"{out} is there already; name a new file")
    partial = out.with_name(out.name + ".part")
    partial.unlink(missing_ok=True)
    engine = make_engine(address_of(partial))
    try:
        with store.reading() as session, initialise_store(engine) as copy:
            key = get_campaign_id(session, campaign)
            origin = session.connection()
            _refuse_damaged(origin, campaign, key)
            rows = _carried(origin, copy, members(key), progress)
        engine.dispose()
        partial.rename(out)
    finally:
        engine.dispose()
        partial.unlink(missing_ok=True)
    return rows


def export_recording(store: Store, part: Part, out: Path) -> None:
    """Write one recording with its hits to a new file, from which `merging.import_file` takes it
    back.

    Parameters:
        store: The open store.
        part: The recording.
        out: The path of the file. One that is there already was written by an earlier call, and
            stays.
    """
    if out.exists() or part.recording_id is None:
        return
    out.parent.mkdir(parents=True, exist_ok=True)
    partial = out.with_name(out.name + ".part")
    partial.unlink(missing_ok=True)
    engine = make_engine(address_of(partial))
    try:
        with store.reading() as session, initialise_store(engine) as copy:
            chosen = members_of_recording(part.campaign_id, part.recording_id)
            _carried(session.connection(), copy, chosen, None)
        engine.dispose()
        partial.rename(out)
    finally:
        engine.dispose()
        partial.unlink(missing_ok=True)


def address_of(file: Path) -> str:
    """The address of the store in a file.

    Parameters:
        file: The path of the file.
    """
    return URL.create("sqlite", database=str(file)).render_as_string()


def _refuse_damaged(origin: Connection, campaign: str, key: int) -> None:
    finding = next(iter_findings(origin, checks(of_a_campaign=True), key), None)
    if finding is not None:
        raise StoreError(
            f"campaign {campaign} is not whole: {finding}; pyroshock db check names all of it"
        )


def _carried(
    origin: Connection,
    copy: Connection,
    chosen: Mapping[str, ColumnElement[bool]],
    progress: Progress | None,
) -> dict[str, int]:
    tables = [table for table in metadata.sorted_tables if table.name in chosen]
    counts = [
        origin.scalar(select(func.count()).select_from(t).where(chosen[t.name])) or 0
        for t in tables
    ]
    bar = ProgressBar(progress, 2 * sum(counts))
    copy.execute(text("PRAGMA defer_foreign_keys = ON"))  # who wrote the rows is known after them
    writers: set[int] = set()
    written = {}
    for table in tables:
        digest, at = TableDigest(), table.columns.keys().index("written_by_id")
        batches = digest.watch(iter_batches(origin, table, chosen[table.name]))
        load(copy, table, bar.watch(_noting(batches, at, writers), f"exporting {table.name}"))
        written[table] = digest
    source = metadata.tables[WRITERS]
    load(copy, source, iter_batches(origin, source, Provenance.id.in_(sorted(writers))))
    for table, digest in written.items():
        verify(copy, table, digest, bar)
    return {table.name: digest.rows for table, digest in written.items()} | {WRITERS: len(writers)}


def _noting(
    batches: Iterator[Sequence[Values]], at: int, seen: set[int]
) -> Iterator[Sequence[Values]]:
    for batch in batches:
        seen.update(row[at] for row in batch)
        yield batch


#: What reading the rows takes for granted, in this order.
_FORM: tuple[Check, ...] = (check_database, check_values, check_names, check_references)
_CONTENT: tuple[Check, ...] = (
    check_rows,
    check_fingerprints,
    check_belonging,
    check_pulses,
    check_series,
    check_attachments,
)
#: Findings that a refusal names.
_MOST_FINDINGS = 10
#: Bytes of one value: far above the largest frame or report, far below what would fill a memory.
_LONGEST_VALUE = 64 * 2**20
_OWN_TABLES = frozenset({"alembic_version", "sqlite_stat1", "sqlite_stat4"})


class ForeignFileError(StoreError):
    """The file cannot be taken into the store; the message says what is wrong with it."""


@contextmanager
def opened_file(file: Path, progress: Progress | None = None) -> Iterator[Connection]:
    """A connection to a file that has passed all checks, in one state.

    Parameters:
        file: The path of the file, as `export_campaign` wrote it.
        progress: Called with (done, total, what) while series are checked, in samples; by default
            progress is not reported.

    Raises:
        ForeignFileError: For a file that does not pass its checks.
        StoreVersionError: For a file of another version of this software.
    """
    # Not an engine of ours: that one writes (its journal's mode), and trusts what it opens.
    engine = create_engine("sqlite://", creator=lambda: _connected(file), poolclass=NullPool)
    try:
        with engine.connect() as connection:
            connection.execute(text("BEGIN"))
            _refuse_other_schema(connection, file)
            for chosen in (*((check,) for check in _FORM), _CONTENT):
                _refuse_damaged_file(
                    file, list(iter_findings(connection, chosen, progress=progress))
                )
            yield connection
    except DBAPIError as error:
        raise ForeignFileError(
            f"{file} cannot be read as a file of pyroshock db export: {first_line(error)}"
        ) from error
    finally:
        engine.dispose()


def _refuse_damaged_file(file: Path, findings: Sequence[IntegrityFinding]) -> None:
    if not findings:
        return
    lines = [finding.what for finding in findings[:_MOST_FINDINGS]]
    if len(findings) > _MOST_FINDINGS:
        lines.append(f"and {len(findings) - _MOST_FINDINGS} further findings")
    raise ForeignFileError(
        f"{file} is refused, and nothing of it was stored: {'; '.join(lines)}; ask for another "
        "export, or take the file from its backup"
    )


def _connected(file: Path) -> sqlite3.Connection:
    connection = sqlite3.connect(
        f"file:{quote(str(file.absolute()))}?mode=ro", uri=True, isolation_level=None
    )
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LONGEST_VALUE)
    for pragma in (
        "trusted_schema = OFF",
        "cell_size_check = ON",
        "query_only = ON",
        "mmap_size = 0",
    ):
        connection.execute(f"PRAGMA {pragma}")
    return connection


def _refuse_other_schema(connection: Connection, file: Path) -> None:
    """Tables and indices of this software's revision, and nothing that runs when they are read."""
    parts = connection.execute(
        text("SELECT type, name, coalesce(sql, '') FROM sqlite_master")
    ).all()
    for kind, name, sql in parts:
        if kind not in ("table", "index") or sql.upper().lstrip().startswith("CREATE VIRTUAL"):
            raise ForeignFileError(
                f"{file} is refused: it holds the {kind} {name!r:.80}, which no export has"
            )
    tables = {name for kind, name, _ in parts if kind == "table"}
    _refuse_other_revision(connection, file, tables)
    own_tables = set(metadata.tables)
    for name in sorted((tables - _OWN_TABLES) ^ own_tables):
        raise ForeignFileError(
            f"{file} is refused: table {name!r:.80} is "
            f"{'missing' if name in own_tables else 'unknown'}"
        )
    for table in metadata.sorted_tables:
        columns = connection.execute(
            text("SELECT name, hidden FROM pragma_table_xinfo(:table)"), {"table": table.name}
        )
        if {(name, hidden) for name, hidden in columns} != {
            (column.name, 0) for column in table.columns
        }:
            raise ForeignFileError(
                f"{file} is refused: table {table.name} has other columns than an export's"
            )


def _refuse_other_revision(connection: Connection, file: Path, tables: set[str]) -> None:
    if "alembic_version" not in tables:
        raise ForeignFileError(f"{file} is no file of pyroshock db export")
    revision = connection.scalar(text("SELECT version_num FROM alembic_version"))
    if revision == migrate.HEAD:
        return
    raise migrate.version_error(str(file), address_of(file), str(revision))


_BLOCK = 2**20


@dataclass(frozen=True)
class Archive:
    """A file with one campaign: its absolute path, its SHA-256, the hash of the campaign's
    content, and that of what is attached to it."""

    path: Path
    sha256: str
    campaign: str
    content_hash: str
    attached_hash: str


def write_archive(
    store: Store, campaign: str, out: Path, progress: Progress | None = None
) -> Archive:
    """Write a campaign to a file and read the file back with every check of a file from elsewhere.

    The store is not changed.

    Parameters:
        store: The open store that holds the campaign.
        campaign: The name of the campaign.
        out: The path of the file. A file that an earlier call has written whole is read back and
            taken as it is.
        progress: Called with (done, total, what), in rows, then in samples; by default progress is
            not reported.

    Raises:
        LookupError: As `export_campaign`.
        StoreError: As `export_campaign`.
        ForeignFileError: Where the file does not hold what the store holds.
    """
    with store.reading() as session:
        part = campaign_part(session, campaign)
        expected = (campaign, content_hash(session, part), attached_hash(session, part))
    if not out.exists():
        export_campaign(store, campaign, out, progress)
        _to_disk(out)
    archive = read_archive(out, progress)
    if (archive.campaign, archive.content_hash, archive.attached_hash) != expected:
        raise ForeignFileError(
            f"{out} does not hold campaign {campaign!r} as the store has it "
            f"now; nothing was deleted: name a new file"
        )
    return archive


def read_archive(file: Path, progress: Progress | None = None) -> Archive:
    """What a file with one campaign holds.

    Parameters:
        file: The path of the file.
        progress: Called with (done, total, what) while series are checked, in samples; by default
            progress is not reported.

    Raises:
        ForeignFileError: Where the file does not pass its checks, or holds no single campaign.
        StoreVersionError: As `opened_file`.
    """
    with opened_file(file, progress) as origin:
        return archive_of(file, origin)


def archive_of(file: Path, origin: Connection) -> Archive:
    """What a file with one campaign holds, which is open and has passed its checks.

    Parameters:
        file: The path of the file.
        origin: The connection to the file that `opened_file` gives.

    Raises:
        ForeignFileError: Where the file holds no single campaign.
    """
    names = list(origin.scalars(select(Campaign.name).order_by(Campaign.name)))
    if len(names) != 1:
        raise ForeignFileError(
            f"{file} holds {len(names)} campaigns, an archive holds one; "
            f"pyroshock db import takes it"
        )
    with Session(origin) as session:
        part = campaign_part(session, names[0])
        digests = content_hash(session, part), attached_hash(session, part)
    return Archive(file.resolve(), _sha256(file), names[0], *digests)


def _sha256(file: Path) -> str:
    digest = hashlib.sha256()
    with file.open("rb") as stream:
        while block := stream.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()


def _to_disk(file: Path) -> None:
    """Until it lies on the disk, the file is no reason to delete anything."""
    for path in (file, file.resolve().parent):
        with suppress(PermissionError, IsADirectoryError):  # not every system opens a folder
            descriptor = os.open(path, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
