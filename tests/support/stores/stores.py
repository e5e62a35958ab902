"""Looking into stores: what they hold, apart from keys and clocks, and whether it is whole."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from click.testing import CliRunner, Result
from pyroshock.app.doors.command_line.main import main
from pyroshock.schema.impacts import Impact, Pulse
from pyroshock.schema.recordings import RecordedChannel, Recording
from pyroshock.schema.series import layout_of, read_slice, series_hash
from pyroshock.schema.session import Store, Writer, count_rows, open_store
from pyroshock.schema.tables import metadata
from sqlalchemy import event, func, select, text
from sqlalchemy.orm import Session

#: When and by whom, not what; the hash is of these, too.
_NOT_CONTENT = ("id", "written_by_id", "extracted_at", "stored_at", "row_sha256")

CLI = [sys.executable, "-c", "from pyroshock.app.doors.command_line.main import main; main()"]


def pyroshock(*arguments: str | Path, typed: str = "") -> Result:
    """The command line within this process, with `typed` on standard input; a traceback fails the
    test that caused it."""
    result = CliRunner().invoke(main, [str(a) for a in arguments], input=typed)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def run_pyroshock(*arguments: str | Path, code: int = 0, typed: str = "") -> Result:
    """The command line that must end with this code."""
    result = pyroshock(*arguments, typed=typed)
    assert result.exit_code == code, result.output
    return result


def refusal(*arguments: str | Path) -> str:
    """The one line with which the command line refuses."""
    result = pyroshock(*arguments)
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1), result.output
    return result.stderr


def ingest(url: str, *folders: Path) -> Result:
    """`pyroshock ingest` in one process."""
    return pyroshock("ingest", *folders, "--db", url, "--jobs", "1")


def ingested(url: str, *folders: Path) -> Result:
    """`pyroshock ingest` that must succeed."""
    return run_pyroshock("ingest", *folders, "--db", url, "--jobs", "1")


def ingest_report(url: str, folder: Path) -> tuple[dict[str, Any], str]:
    """What an ingest that must succeed says: its report, and its notes."""
    result = pyroshock("ingest", folder, "--db", url, "--jobs", "1", "--json")
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout), result.stderr


def start_cli(*arguments: str | Path) -> subprocess.Popen[str]:
    """The command line in a process of its own."""
    command = [*CLI, *(str(a) for a in arguments)]
    environment = {**os.environ, "PYTHONWARNINGS": "default"}
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    )


@contextmanager
def opened(url: str, *, create: bool = False) -> Iterator[Store]:
    with open_store(url, Writer("test", "0"), create=create) as store:
        yield store


def counts(url: str) -> dict[str, int]:
    """Rows per table; all zero where there is no store yet."""
    with opened(url, create=True) as store:
        return count_rows(store)


def content(url: str) -> dict[str, list[str]]:
    """The store's rows as digests without surrogate keys, in an order of their own: equal for equal
    content."""
    digests: dict[str, dict[Any, str]] = {}
    with opened(url) as store, store.reading() as session:
        for table in metadata.sorted_tables:
            if table.name in ("provenance", "jobs", "audit_rows"):  # who did it, and how
                continue
            digests[table.name] = {}
            for number, row in enumerate(session.execute(select(table)).mappings()):
                cells = [
                    f"{column.name}={_value(column, row[column.name], digests)!r}"
                    for column in table.columns
                    if column.name not in _NOT_CONTENT
                ]
                key = row["id"] if "id" in table.columns else number
                digests[table.name][key] = hashlib.sha256("\n".join(cells).encode()).hexdigest()
    return {name: sorted(rows.values()) for name, rows in digests.items()}


def _value(column: Any, value: Any, digests: dict[str, dict[Any, str]]) -> Any:
    """A foreign key as the digest of the row it points at."""
    for key in column.foreign_keys:
        return None if value is None else digests[key.column.table.name][value]
    return value


def assert_whole(url: str, hits_per_recording: int) -> None:
    """The store is consistent, and every stored recording is there with all samples, impacts and
    pulses."""
    with opened(url) as store, store.reading() as session:
        if store.engine.dialect.name == "sqlite":
            assert session.scalars(text("PRAGMA integrity_check")).all() == ["ok"]
            assert session.execute(text("PRAGMA foreign_key_check")).all() == []
        for recording in session.scalars(select(Recording).where(Recording.status == "stored")):
            assert recording.channels, recording.path
            for channel in recording.channels:
                assert _hash(session, channel) == channel.sha256, (recording.path, channel.name)
            impacts = select(Impact.id).where(Impact.recording_id == recording.id)
            assert len(session.scalars(impacts).all()) == hits_per_recording, recording.path
            pulses = select(func.count()).where(Pulse.impact_id.in_(impacts), Pulse.current)
            assert session.scalar(pulses) == hits_per_recording, recording.path


def _hash(session: Session, row: RecordedChannel) -> str:
    return series_hash(read_slice(session.connection(), row.id, layout_of(row), 0, row.samples))


@contextmanager
def statements(store: Store) -> Iterator[list[str]]:
    """The list fills with the statements that are sent; one for many rows is one."""
    executed: list[str] = []

    def note(_connection: Any, _cursor: Any, statement: str, *_: Any) -> None:
        executed.append(statement)

    event.listen(store.engine, "before_cursor_execute", note)
    try:
        yield executed
    finally:
        event.remove(store.engine, "before_cursor_execute", note)
