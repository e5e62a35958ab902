"""A file from elsewhere, looked at without trust: opened to read alone, and refused unless it is what we write."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import quote

from sqlalchemy import Connection, create_engine, text
from sqlalchemy.exc import DBAPIError
from sqlalchemy.pool import NullPool

from .. import migrate
from ..care.checking import iter_findings
from ..care.checks.cross_table_rules import check_belonging
from ..care.checks.database import check_database
from ..care.checks.fingerprints import check_fingerprints
from ..care.checks.json_columns import check_names
from ..care.checks.pulses import check_pulses
from ..care.checks.references import check_references
from ..care.checks.series import check_series
from ..care.checks.values import check_values
from ..care.progress import Progress
from ..engine import StoreError, StoreVersionError, first_line
from ..tables import metadata
from .export import address_of

#: In this order: what a later check takes for granted, an earlier one has seen to.
_CHECKS = (
    check_database,
    check_values,
    check_names,
    check_references,
    check_fingerprints,
    check_belonging,
    check_pulses,
    check_series,
)
#: Bytes of one value: far above the largest frame or report, far below what would fill a memory.
_LONGEST_VALUE = 64 * 2**20
_OWN_TABLES = frozenset({"alembic_version", "sqlite_stat1", "sqlite_stat4"})


class ForeignFileError(StoreError):
    """The file cannot be taken into the store; the message says what is wrong with it."""


@contextmanager
def opened_file(file: Path, progress: Progress | None = None) -> Iterator[Connection]:
    """A connection to a file that has passed all checks, in one state. Raises `ForeignFileError`."""
    # Not an engine of ours: that one writes (its journal's mode), and trusts what it opens.
    engine = create_engine("sqlite://", creator=lambda: _connected(file), poolclass=NullPool)
    try:
        with engine.connect() as connection:
            connection.execute(text("BEGIN"))
            _refuse_other_schema(connection, file)
            for finding in iter_findings(connection, _CHECKS, progress=progress):
                raise ForeignFileError(f"{file} is refused: {finding}")
            yield connection
    except DBAPIError as error:
        raise ForeignFileError(
            f"{file} cannot be read as a file of pyroshock db export: {first_line(error)}"
        ) from error
    finally:
        engine.dispose()


def _connected(file: Path) -> sqlite3.Connection:
    connection = sqlite3.connect(f"file:{quote(str(file.absolute()))}?mode=ro", uri=True, isolation_level=None)
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LONGEST_VALUE)
    for pragma in ("trusted_schema = OFF", "cell_size_check = ON", "query_only = ON", "mmap_size = 0"):
        connection.execute(f"PRAGMA {pragma}")
    return connection


def _refuse_other_schema(connection: Connection, file: Path) -> None:
    """Tables and indices of this software's revision, and nothing that runs when they are read."""
    parts = connection.execute(text("SELECT type, name, coalesce(sql, '') FROM sqlite_master")).all()
    for kind, name, sql in parts:
        if kind not in ("table", "index") or sql.upper().lstrip().startswith("CREATE VIRTUAL"):
            raise ForeignFileError(f"{file} is refused: it holds the {kind} {name!r:.80}, which no export has")
    tables = {name for kind, name, _ in parts if kind == "table"}
    _refuse_other_revision(connection, file, tables)
    own_tables = set(metadata.tables)
    for name in sorted((tables - _OWN_TABLES) ^ own_tables):
        raise ForeignFileError(
            f"{file} is refused: table {name!r:.80} is {'missing' if name in own_tables else 'unknown'}"
        )
    for table in metadata.sorted_tables:
        columns = connection.execute(text("SELECT name, hidden FROM pragma_table_xinfo(:table)"), {"table": table.name})
        if {(name, hidden) for name, hidden in columns} != {(column.name, 0) for column in table.columns}:
            raise ForeignFileError(f"{file} is refused: table {table.name} has other columns than an export's")


def _refuse_other_revision(connection: Connection, file: Path, tables: set[str]) -> None:
    if "alembic_version" not in tables:
        raise ForeignFileError(f"{file} is no file of pyroshock db export")
    revision = connection.scalar(text("SELECT version_num FROM alembic_version"))
    if revision == migrate.HEAD:
        return
    if revision in migrate.known_revisions():
        raise StoreVersionError(
            f"{file} is at revision {revision}, older than this software: pyroshock db upgrade --db {address_of(file)}"
        )
    raise StoreVersionError(
        f"{file} is at revision {revision!r:.40}, which this software does not know: update pyroshock"
    )
