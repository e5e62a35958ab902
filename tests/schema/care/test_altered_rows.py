"""One cell altered in every column of a store with everything in it: the check names table and row.
Random bits flipped in a file: none that changes a row is missed."""

from __future__ import annotations

import datetime as dt
import random
import shutil
import sqlite3
import struct
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest
from pyroshock.schema.campaigns import Factor
from pyroshock.schema.column_kinds import (
    BYTES,
    DAY,
    INTEGER,
    JSON_TEXT,
    NUMBER,
    TEXT,
    TIME,
    TRUTH,
    kind_of,
)
from pyroshock.schema.engine import StoreError, make_engine
from pyroshock.schema.integrity.checking import checks, iter_findings
from pyroshock.schema.tables import metadata
from sqlalchemy import CheckConstraint, Engine, select, text, update
from sqlalchemy.exc import DBAPIError
from support.stores.full_stores import fill_every_column
from support.stores.stores import opened

#: SQL of another value of the same kind.
OTHERS = {
    INTEGER: "{0} + 1000",
    NUMBER: "{0} * 1.0000000001 + 1e-300",
    TEXT: "{0} || '~'",
    JSON_TEXT: "'[0]'",
    TRUTH: "NOT {0}",
    TIME: "'2026-03-02 10:30:15.000251'",
    DAY: "'2026-03-09'",
}
OTHER_BYTES = {"sqlite": "CAST({0} || x'00' AS BLOB)", "postgresql": r"{0} || '\x00'::bytea"}


@pytest.fixture(scope="module")
def full_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An SQLite store that holds a value in every column; tests copy it."""
    folder = tmp_path_factory.mktemp("full")
    fill_every_column(folder)
    return folder / "lab.db"


@pytest.fixture(params=["sqlite", "postgresql"])
def new_copy(request: pytest.FixtureRequest, full_file: Path, tmp_path: Path) -> Callable[[], Any]:
    """Each call gives the address of a fresh copy of that store, on either engine in turn, for a
    `with` block."""
    if request.param == "postgresql":
        postgres_copy = request.getfixturevalue("postgres_copy")
        return lambda: postgres_copy(full_file)

    @contextmanager
    def copy() -> Iterator[str]:
        yield f"sqlite:///{shutil.copyfile(full_file, tmp_path / 'full.db')}"

    return copy


def findings_of(url: str) -> list[Any]:
    with opened(url) as store, store.reading() as session:
        return list(iter_findings(session.connection(), checks()))


def keys_by_column(url: str) -> dict[Any, tuple[Any, ...] | None]:
    """Of each column of each declared table, the key of a row that has a value there."""
    keys = {}
    with opened(url) as store, store.reading() as session:
        for table in metadata.sorted_tables:
            primary = list(table.primary_key.columns)
            for column in table.columns:
                # A truth is altered from true to false: of two that are true, an index may forbid
                # the second.
                order = [column.desc()] if kind_of(column) == TRUTH else []
                query = (
                    select(*primary)
                    .where(column.is_not(None))
                    .order_by(*order, *(key.desc() for key in primary))
                )
                row = session.execute(query.limit(1)).one_or_none()
                keys[column] = None if row is None else tuple(row)
    return keys


def alter(connection: Any, column: Any, key: tuple[Any, ...]) -> str:
    """Alter one cell as no rule of the store allows; the key under which its row is afterwards."""
    table, kind, engine = column.table, kind_of(column), connection.dialect.name
    other = (OTHER_BYTES[engine] if kind == BYTES else OTHERS[kind]).format(f'"{column.name}"')
    primary = list(table.primary_key.columns)
    where = " AND ".join(
        f'"{part.name}" = {value}' for part, value in zip(primary, key, strict=True)
    )
    changed = connection.execute(
        text(f'UPDATE "{table.name}" SET "{column.name}" = {other} WHERE {where}')
    )
    assert changed.rowcount == 1
    moved = (
        value + 1000 if part is column else value for part, value in zip(primary, key, strict=True)
    )
    return "/".join(map(str, moved))


def without_rules(connection: Any) -> None:
    """A program that edits the file, or a superuser, to whom nothing is forbidden."""
    if connection.dialect.name == "sqlite":
        return
    connection.execute(text("SET LOCAL session_replication_role = replica"))
    for table in metadata.sorted_tables:
        for rule in table.constraints:
            if isinstance(rule, CheckConstraint):
                connection.execute(
                    text(f'ALTER TABLE "{table.name}" DROP CONSTRAINT IF EXISTS "{rule.name}"')
                )


def altered_in_turn(
    new_copy: Callable[[], Any], columns: dict[Any, tuple[Any, ...]]
) -> Iterator[tuple[Any, bool]]:
    """Each column, and whether the check named the row of its altered cell; one column of each
    table at a time."""
    turns: list[dict[Any, tuple[Any, ...]]] = []
    counts: Counter[str] = Counter()
    for column, key in columns.items():
        turn = counts[column.table.name]
        counts[column.table.name] += 1
        if turn == len(turns):
            turns.append({})
        turns[turn][column] = key
    with new_copy() as url:
        engine = make_engine(url)
        with engine.connect() as connection:
            for chosen in turns:
                with unruled(connection):
                    places = {
                        column: (column.table.name, alter(connection, column, key))
                        for column, key in chosen.items()
                    }
                    named = {
                        (finding.place.get("table"), finding.place.get("row"))
                        for finding in iter_findings(connection, checks())
                    }
                yield from ((column, place in named) for column, place in places.items())
        engine.dispose()


@contextmanager
def unruled(connection: Any) -> Iterator[None]:
    """A transaction of one to whom nothing is forbidden, never committed: its store is whole for
    the next."""
    if connection.dialect.name == "sqlite":
        connection.connection.execute("PRAGMA foreign_keys = OFF")
        connection.connection.execute("PRAGMA ignore_check_constraints = ON")
    with connection.begin() as transaction:
        without_rules(connection)
        yield
        transaction.rollback()


def test_an_altered_cell_of_every_column_is_named_with_table_and_row(new_copy):
    with new_copy() as url:
        assert findings_of(url) == []
        keys = keys_by_column(url)
    assert [
        str(column) for column, key in keys.items() if key is None
    ] == []  # a new column is filled in `full_stores`
    named: Counter[str] = Counter()
    missed = []
    for column, is_named in altered_in_turn(new_copy, keys):
        named[column.table.name] += is_named
        if not is_named:
            missed.append(str(column))
    print(f"\ncolumns altered {len(keys)}, rows named {sum(named.values())}")
    for table in metadata.sorted_tables:
        print(f"{table.name:24} {len(table.columns):3} altered {named[table.name]:3} named")
    assert missed == []


def test_the_row_of_an_altered_cell_is_named_by_what_people_call_it(new_copy):
    with new_copy() as url:
        engine = make_engine(url)
        with engine.begin() as connection:
            connection.execute(text("UPDATE channels SET si_gain = si_gain * 1.1 WHERE id = 2"))
            connection.execute(
                text("UPDATE pulses SET peak_force_n = peak_force_n * 1.1 WHERE id = 3")
            )
        engine.dispose()
        places = [finding.place for finding in findings_of(url) if finding.check == "rows"]
    recording = {"campaign": "spring", "recording": "recordings/test-01.npz"}
    assert places[0] == {**recording, "channel": "acceleration_1", "table": "channels", "row": "2"}
    assert places[1] == {
        **recording,
        "plan": "spring",
        "run": 1,
        "repetition": 3,
        "table": "pulses",
        "row": "3",
    }


def test_a_row_that_was_inserted_by_hand_is_named_and_not_approved_by_the_next_command(new_copy):
    with new_copy() as url:
        engine = make_engine(url)
        with engine.begin() as connection:
            connection.execute(
                text("INSERT INTO factors (id, name, written_by_id) VALUES (900, 'by hand', 1)")
            )
        engine.dispose()
        with opened(url) as store, store.writing() as session:
            session.execute(
                update(Factor).where(Factor.id == 1).values(description="by the software")
            )
        (finding,) = [finding for finding in findings_of(url) if finding.check == "rows"]
    assert (finding.place["table"], finding.place["row"], finding.place["factor"]) == (
        "factors",
        "900",
        "by hand",
    )
    assert "carries no hash" in finding.message


def test_a_file_whose_table_names_are_no_text_is_told_in_one_line(full_file, tmp_path):
    content = full_file.read_bytes()
    assert b"CREATE TABLE guns" in content
    (tmp_path / "x.db").write_bytes(
        content.replace(b"CREATE TABLE guns", b"CREATE TABLE g\xc1\xff(")
    )
    assert is_told(tmp_path / "x.db")


def rows_of(file: Path) -> dict[str, list[str]] | None:
    """All rows as SQLite itself reads them, whatever their order; None where it cannot."""
    rows = {}
    try:
        with closing(sqlite3.connect(file)) as connection:
            connection.text_factory = bytes
            for table in metadata.sorted_tables:
                rows[table.name] = sorted(
                    map(repr, connection.execute(f'SELECT * FROM "{table.name}"'))
                )
    except (
        sqlite3.Error,
        UnicodeDecodeError,
    ):  # of a column's name, which the driver decodes itself
        return None
    return rows


def is_told(file: Path) -> bool:
    """Whether the software says that the file is damaged: by a finding, or because it cannot be
    used at all."""
    try:
        return findings_of(f"sqlite:///{file}") != []
    except (StoreError, DBAPIError):
        return True


def has_finding(engine: Engine) -> bool:
    """Whether the check finds anything; False where it cannot be made. The file may be replaced
    afterwards."""
    try:
        with engine.connect() as connection:
            return any(True for _ in iter_findings(connection, checks()))
    except (
        DBAPIError,
        UnicodeDecodeError,
    ):  # no finding of a file that cannot be read: `is_told` asks then
        return False
    finally:
        engine.dispose()


FLIPS = [40, pytest.param(1000, marks=[pytest.mark.slow, pytest.mark.timeout(3600)])]


@pytest.mark.parametrize("flips", FLIPS)
def test_no_flipped_bit_that_changes_a_row_is_missed(full_file, tmp_path, flips):
    """A thousand flips take some two minutes of processor time."""
    file = tmp_path / "flipped.db"
    engine = make_engine(
        f"sqlite:///{file}"
    )  # one for all, which compiles each statement of the check once
    content, sound = full_file.read_bytes(), rows_of(full_file)
    outcomes: Counter[str] = Counter()
    rng, missed = random.Random(flips), []
    for _ in range(flips):
        place, bit = rng.randrange(len(content)), rng.randrange(8)
        damaged = bytearray(content)
        damaged[place] ^= 1 << bit
        file.write_bytes(damaged)
        rows = rows_of(file)
        if rows == sound:
            outcomes["no row changed"] += 1
        elif has_finding(engine) or is_told(file):
            outcomes["told: unreadable" if rows is None else "told: a row changed"] += 1
        else:
            missed.append((place, bit))
        for suffix in ("", "-wal", "-shm"):
            Path(f"{file}{suffix}").unlink(missing_ok=True)
    print(f"\n{flips} flips of {len(content)} bytes: {dict(outcomes)}, missed {len(missed)}")
    assert missed == []
    assert outcomes["told: a row changed"] >= flips // 20  # else nothing was shown


def with_flipped_bit(kind: str, value: Any, rng: random.Random) -> Any:
    """A stored value with one bit the other way; None where PostgreSQL can hold no such text.

    Of times and days, which are counts of microseconds and of days, one bit more.
    """
    if kind == TRUTH:
        return not value
    if kind == INTEGER:
        return value ^ 1 << rng.randrange(31)
    if kind == NUMBER:
        (bits,) = struct.unpack("<Q", struct.pack("<d", value))
        return struct.unpack("<d", struct.pack("<Q", bits ^ 1 << rng.randrange(64)))[0]
    if kind == TIME:
        return value + dt.timedelta(microseconds=1 << rng.randrange(40))
    if kind == DAY:
        return value + dt.timedelta(days=1 << rng.randrange(12))
    content = bytearray(value if kind == BYTES else value.encode())
    if content:
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    if kind == BYTES:
        return bytes(content)
    try:
        return None if 0 in content else content.decode()
    except UnicodeDecodeError:  # no text that the column could hold
        return None


def flip_cell(
    connection: Any, column: Any, rng: random.Random, flipped_rows: set[tuple[str, str]]
) -> tuple[str, str] | None:
    """Flip a bit in a random cell of the column; table and key of its row, which is none of
    `flipped_rows`.

    None where the column has no such cell, where the engine refuses the value, and where it equals
    the old one.
    """
    table, kind = column.table, kind_of(column)
    keys = [f'"{key.name}"' for key in table.primary_key.columns]
    column_text = f'CAST("{column.name}" AS text)' if kind == JSON_TEXT else f'"{column.name}"'
    rows = connection.execute(
        text(
            f'SELECT {", ".join(keys)}, {column_text} FROM "{table.name}" '
            f'WHERE "{column.name}" IS NOT NULL ORDER BY 1'
        )
    ).all()
    untouched_rows = [
        row for row in rows if (table.name, "/".join(map(str, row[:-1]))) not in flipped_rows
    ]
    if not untouched_rows:
        return None
    *key, value = rng.choice(untouched_rows)
    flipped = with_flipped_bit(kind, value, rng)
    if flipped is None or flipped == value:  # a zero may change its sign
        return None
    sql_type = column.type.compile(dialect=connection.dialect)
    where = " AND ".join(f"{name} = {part}" for name, part in zip(keys, key, strict=True))
    change = text(
        f'UPDATE "{table.name}" SET "{column.name}" = CAST(:flipped AS {sql_type}) WHERE {where}'
    )
    try:
        with connection.begin_nested():
            assert connection.execute(change, {"flipped": flipped}).rowcount == 1
    except DBAPIError:  # a key that is there already, a text that is no JSON
        return None
    moved = [
        flipped if f'"{column.name}"' == name else part
        for name, part in zip(keys, key, strict=True)
    ]
    return table.name, "/".join(map(str, moved))


@pytest.mark.parametrize("flips", FLIPS)
def test_no_flipped_bit_of_a_cell_is_missed_on_postgresql(postgres_copy, full_file, flips):
    """As many flips as `flips` that change a row, 40 rows at a time; the transaction is never
    committed.

    A thousand take half a minute of processor time.
    """
    columns = [column for table in metadata.sorted_tables for column in table.columns]
    rng, changed, unchanged = random.Random(flips), 0, 0
    missed: list[tuple[str, str]] = []
    with postgres_copy(full_file) as url:
        engine = make_engine(url)
        while changed < flips:
            with engine.connect() as connection, connection.begin() as transaction:
                without_rules(connection)
                places: set[tuple[str, str]] = set()
                while len(places) < min(40, flips - changed):
                    place = flip_cell(connection, rng.choice(columns), rng, places)
                    unchanged += place is None
                    places |= set() if place is None else {place}
                findings = list(iter_findings(connection, checks()))
                transaction.rollback()
            named = {(finding.place.get("table"), finding.place.get("row")) for finding in findings}
            missed += sorted(places - named)
            changed += len(places)
        engine.dispose()
    print(
        f"\n{changed} flips changed a row, {unchanged} were refused or "
        f"changed none, missed {len(missed)}"
    )
    assert missed == []
