"""An upgrade is one transaction: stopped anywhere, the store is as it was; and two at once are one
after the other.

(Kills are in test_killed.py.) A store that newer software made is refused by every command, and
left alone.
"""

from __future__ import annotations

import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest
from click.testing import Result
from pyroshock.app.operations.command_words import COMMANDS
from pyroshock.schema import migrate
from pyroshock.schema.engine import make_engine
from sqlalchemy import MetaData, Table, event, update
from support.stores import later_revision
from support.stores.many_databases import Databases, Files
from support.stores.stored_databases import dump, stored_database
from support.stores.stores import opened, pyroshock


class _Stopped(Exception):
    """Stands for whatever may stop an upgrade."""


def stopped_at(url: str, number: int) -> bool:
    """Whether an upgrade had a statement of this number; it is stopped before it."""
    engine, seen = make_engine(url), [0]

    @event.listens_for(engine, "before_cursor_execute")
    def stop(*_):
        seen[0] += 1
        if seen[0] == number:
            raise _Stopped

    try:
        migrate.upgrade(engine)
    except _Stopped:
        return True
    finally:
        engine.dispose()
    return False


@pytest.mark.slow
def test_upgrade_stopped_before_any_statement_changes_nothing(
    databases: Databases, tmp_path, later
):
    """Between any two of its statements: SQLite's copies of tables are within the transaction as
    all else is."""
    url = stored_database(databases, tmp_path)
    later()
    before, number = dump(url), 1
    while stopped_at(url, number):
        assert dump(url) == before, f"stopped at statement {number}"
        number += 1
    assert number > 3
    engine = make_engine(url)
    assert migrate.current_revision(engine) == later_revision.REVISION
    assert migrate.differences(engine) == []
    engine.dispose()


RENAME = """
    with op.batch_alter_table("materials", recreate="always") as batch:
        batch.alter_column("name", new_column_name="called")
"""


@pytest.fixture
def later(tmp_path):
    """Called, it lets this process be the software with one revision more."""
    with ExitStack() as installed:

        def become(change: str = later_revision.CHANGE_MATERIALS) -> None:
            folder = later_revision.write_revision(tmp_path / "later", change)
            installed.callback(later_revision.install(folder))

        yield become


def test_migration_that_makes_a_table_anew_keeps_its_rows(tmp_path, later):
    """SQLite cannot alter a table's rules: Alembic makes a new one, moves the rows, drops the old
    one."""
    url = stored_database(Files(tmp_path), tmp_path)
    later(RENAME)
    before, engine = dump(url), make_engine(url)
    migrate.upgrade(engine)
    assert dump(url)["materials"] == before["materials"]
    with engine.connect() as connection:
        assert "called" in Table("materials", MetaData(), autoload_with=connection).c
        assert connection.exec_driver_sql("PRAGMA foreign_keys").scalar() == 1
        assert connection.exec_driver_sql("PRAGMA foreign_key_check").all() == []
    engine.dispose()


@pytest.mark.parametrize(
    ("end", "said"),
    [
        ("raise RuntimeError('stopped')", "stopped"),
        ("op.execute(sa.text('DELETE FROM campaigns'))", "a reference to no row"),
    ],
)
def test_migration_that_ends_badly_is_undone(tmp_path, later, end, said):
    url = stored_database(Files(tmp_path), tmp_path)
    later(f"{RENAME}    {end}")
    before, engine = dump(url), make_engine(url)
    with pytest.raises(RuntimeError, match=said):
        migrate.upgrade(engine)
    engine.dispose()
    assert dump(url) == before


@pytest.mark.slow
def test_two_upgrades_at_once_are_one(databases: Databases, tmp_path):
    url = stored_database(databases, tmp_path)
    by_one, folder = databases.copy(url), later_revision.write_revision(tmp_path / "later")

    def upgrade(store: str) -> subprocess.Popen[str]:
        program = [sys.executable, later_revision.__file__, str(folder)]
        command = [*program, "db", "upgrade", "--db", store]
        return subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path
        )

    processes = [upgrade(store) for store in (url, url, by_one)]
    ends = [process.communicate(timeout=100) for process in processes]
    assert [process.returncode for process in processes] == [0, 0, 0], ends
    assert dump(url) == dump(by_one) and "first second" in str(dump(url)["materials"])


#: Every command that opens a store, with what else it needs.
COMMAND_LINES = (
    "init", "ingest .", "plan status autumn", "simulate autumn --out simulated", "campaigns",
    "runs list spring",
    "impacts", "shots", "query --tables", "show 1", "extract spring", "dataset list",
    "train spring", "compare",
    "promote hybrid 1", "validate spring",
    "predict --tank-pressure 5bar --bullet-mass 0.5kg --tip steel",
    "tune --target target.csv", "diagnose spring", "diagnoses adopt 1",
    "report spring --out report.html",
    "serve --port 0", "work --once",
    "users", "audit", "notes", "tags", "attachments", "filters", "search x",
    "jobs", "export impacts --out impacts.csv", "materials", "db check",
    # The rest of a group whose first command is above.
    "campaigns deleted", "campaigns delete spring --reason r",
    "campaigns correct spring --set tip_radius_mm=30 --reason r",
    "runs restore spring 1.npz",
    "campaigns archive spring --out spring.pyroshock --reason r",
    "campaigns restore target.csv", "runs discard spring 1.npz --reason r",
    "runs replace spring 1.npz --from . --reason r",
    "plans list", "datasets list", "diagnoses list",
    "db backup kept", "models recover",
    "db upgrade", "db export spring --out spring.pyroshock", "db import target.csv",
    "plan quality autumn", "plan list", "explore", "views list", "home list",
)  # fmt: skip
#: These open no store, or one of their own.
WITHOUT_STORE = {"calibrate", "models", "srs", "blind-check", "demo", "plugins"}


def test_every_command_is_here_or_needs_no_store_and_a_newer_store_is_not_copied(newer, tmp_path):
    assert set(COMMANDS) == {line.split()[0] for line in COMMAND_LINES} | WITHOUT_STORE
    refused(pyroshock("db", "copy", newer, f"sqlite:///{tmp_path / 'copy.db'}"))


@pytest.fixture(scope="module")
def newer(tmp_path_factory) -> str:
    """A store as the software of some year to come leaves it."""
    url = f"sqlite:///{tmp_path_factory.mktemp('newer') / 'lab.db'}"
    with opened(url, create=True) as store:
        version = Table("alembic_version", MetaData(), autoload_with=store.engine)
        with store.engine.begin() as connection:
            connection.execute(update(version).values(version_num="9999"))
    return url


@pytest.mark.parametrize("command", COMMAND_LINES)
def test_newer_store_is_refused_by_every_command(newer, command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "target.csv").write_text(
        "frequency_hz,level_g\n100,10\n1000,100\n10000,100\n", encoding="utf-8"
    )
    before = Path(newer.removeprefix("sqlite:///")).read_bytes()
    refused(pyroshock(*command.split(), "--db", newer))
    assert Path(newer.removeprefix("sqlite:///")).read_bytes() == before


def refused(result: Result) -> None:
    assert result.exit_code == 2, (result.output, result.stderr)
    assert result.stderr.count("\n") == 1, result.stderr
    assert "revision 9999" in result.stderr and "update pyroshock" in result.stderr
