"""One cell altered in every populated column of a store with everything in it: the check names table and row. Random bits
flipped in a file: none that changes a row is missed."""

from __future__ import annotations

import shutil
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from pyroshock.schema.column_kinds import BYTES, DAY, INTEGER, JSON_TEXT, NUMBER, TEXT, TIME, TRUTH, kind_of
from pyroshock.schema.engine import make_engine
from pyroshock.schema.integrity.checking import checks, iter_findings
from pyroshock.schema.tables import metadata
from sqlalchemy import select, text
from support.stores.full_stores import fill_every_column
from support.stores.stores import opened

#: SQL of another value of the same kind, which the column's own rules may forbid.
OTHERS = {
    INTEGER: "{0} + 1000",
    NUMBER: "{0} * 1.0000000001 + 1e-300",
    TEXT: "substr({0}, 1, length({0}) - 1) || '~'",
    JSON_TEXT: "'[0]'",
    TRUTH: "NOT {0}",
    TIME: "'2026-03-02 10:30:15.000251'",
    DAY: "'2026-03-09'",
}
OTHER_BYTES = {"sqlite": "{0} || x'00'", "postgresql": r"{0} || '\x00'::bytea"}


@pytest.fixture(scope="module")
def full_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An SQLite store that holds a value in every column; tests copy it."""
    folder = tmp_path_factory.mktemp("full")
    fill_every_column(folder)
    return folder / "lab.db"


@pytest.fixture(params=["sqlite", "postgresql"])
def full_store(request: pytest.FixtureRequest, full_file: Path, tmp_path: Path) -> Any:
    if request.param == "sqlite":
        yield f"sqlite:///{shutil.copyfile(full_file, tmp_path / 'full.db')}"
        return
    with request.getfixturevalue("postgres_copy")(full_file) as url:
        yield url


def populated(url: str) -> dict[Any, tuple[Any, ...]]:
    """Of each column that holds anything, the key of the last row that does: from the tables' declaration."""
    there = {}
    with opened(url) as store, store.reading() as session:
        for table in metadata.sorted_tables:
            key = list(table.primary_key.columns)
            for column in table.columns:
                query = select(*key).where(column.is_not(None)).order_by(*(part.desc() for part in key)).limit(1)
                row = session.execute(query).one_or_none()
                if row is not None:
                    there[column] = tuple(row)
    return there


def another(column: Any, engine: str) -> str:
    kind = kind_of(column)
    return (OTHER_BYTES[engine] if kind == BYTES else OTHERS[kind]).format(f'"{column.name}"')


def alter(url: str, column: Any, key: tuple[Any, ...]) -> None:
    """One cell, by SQL that no rule stops: of a file with its keys off, of a server as its superuser."""
    table, engine = column.table, make_engine(url)
    where = " AND ".join(f'"{part.name}" = {value}' for part, value in zip(table.primary_key.columns, key, strict=True))
    statement = f'UPDATE "{table.name}" SET "{column.name}" = {another(column, engine.dialect.name)} WHERE {where}'
    with engine.connect() as connection:
        if engine.dialect.name == "sqlite":
            connection.connection.execute("PRAGMA foreign_keys = OFF")
            connection.connection.execute("PRAGMA ignore_check_constraints = ON")
        with connection.begin():
            if engine.dialect.name == "postgresql":
                connection.execute(text("SET session_replication_role = replica"))  # no trigger, no foreign key
                for rule in rules_of(table):
                    connection.execute(text(f'ALTER TABLE "{table.name}" DROP CONSTRAINT IF EXISTS "{rule}"'))
            assert connection.execute(text(statement)).rowcount == 1
    engine.dispose()


def rules_of(table: Any) -> list[str]:
    from sqlalchemy import CheckConstraint

    return [str(rule.name) for rule in table.constraints if isinstance(rule, CheckConstraint)]


def findings_of(url: str) -> list[Any]:
    with opened(url) as store, store.reading() as session:
        return list(iter_findings(session.connection(), checks()))


def test_an_altered_cell_of_every_populated_column_is_named(full_store):
    """Each in a row of its own where the table has as many, so that one check finds them all."""
    assert findings_of(full_store) == []
    columns = populated(full_store)
    empty = {f"{c.table.name}.{c.name}" for table in metadata.sorted_tables for c in table.columns} - set(
        map(str, columns)
    )
    assert empty == set()
    found, missed = Counter(), []
    engine_name = full_store.partition(":")[0].partition("+")[0]
    for column, key in columns.items():
        with saved(full_store, column.table) as restore:
            alter(full_store, column, key)
            named = {(finding.place.get("table"), finding.place.get("row")) for finding in row_findings(full_store)}
            restore()
        rows = {"/".join(map(str, key)), "/".join(map(str, moved(column, key)))}
        if any((column.table.name, row) in named for row in rows):
            found[column.table.name] += 1
        else:
            missed.append(str(column))
    assert findings_of(full_store) == []
    print(f"\n{engine_name}: {sum(found.values())} of {len(columns)} columns; {dict(found)}")
    assert missed == []
