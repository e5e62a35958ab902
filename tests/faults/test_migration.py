"""An upgrade is one transaction: stopped anywhere, the store is as it was; and two at once are one
after the other.

(Kills are in test_killed.py.) A store that newer software made is refused by every command, and
left alone.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from click.testing import Result
from pyroshock.app.doors.command_line.main import COMMANDS
from pyroshock.schema import migrate
from pyroshock.schema.engine import make_engine
from sqlalchemy import MetaData, Table, event, update
from support.processes.struck_places import dump, old_store
from support.stores.many_databases import Databases, Files
from support.stores.stores import content, opened, pyroshock, start_cli

OLD = migrate.known_revisions()[:-1]


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
@pytest.mark.parametrize("revision", OLD)
def test_upgrade_stopped_before_any_statement_changes_nothing(
    databases: Databases, tmp_path, revision
):
    """Between any two of its statements: SQLite's copies of tables are within the transaction as
    all else is."""
    url = old_store(databases, tmp_path, revision)
    before, number = dump(url), 1
    while stopped_at(url, number):
        assert dump(url) == before, f"stopped at statement {number}"
        number += 1
    assert number > 3
    engine = make_engine(url)
    assert migrate.current_revision(engine) == migrate.HEAD and migrate.differences(engine) == []
    engine.dispose()


FUTURE = """
from alembic import op
from sqlalchemy import column, delete, table

revision, down_revision, branch_labels, depends_on = "9000", {head!r}, None, None


def upgrade():
    with op.batch_alter_table("materials", recreate="always") as batch:
        batch.alter_column("name", new_column_name="called")
    {end}
"""


@pytest.fixture
def future(tmp_path, monkeypatch):
    """Gives this software a migration more, which makes anew a table that others refer to, and then
    does `end`."""
    here, config = Path(migrate.__file__).parent / "migrations" / "versions", migrate.config

    def add(end: str) -> None:
        (tmp_path / "future").mkdir()
        (tmp_path / "future" / "9000_future.py").write_text(
            FUTURE.format(head=migrate.HEAD, end=end), encoding="utf-8"
        )

        def extended(*given, **extra):
            settings = config(*given, **extra)
            settings.set_main_option(
                "version_locations", os.pathsep.join([str(here), str(tmp_path / "future")])
            )
            return settings

        monkeypatch.setattr(migrate, "config", extended)

    return add


def test_migration_that_makes_a_table_anew_keeps_its_rows(tmp_path, future):
    """SQLite cannot alter a table's rules: Alembic makes a new one, moves the rows, drops the old
    one."""
    url = old_store(Files(tmp_path), tmp_path, OLD[-1])
    future("pass")
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
        ("op.execute(delete(table('campaigns')))", "a reference to no row"),
    ],
)
def test_migration_that_ends_badly_is_undone(tmp_path, future, end, said):
    url = old_store(Files(tmp_path), tmp_path, OLD[-1])
    future(end)
    before, engine = dump(url), make_engine(url)
    with pytest.raises(RuntimeError, match=said):
        migrate.upgrade(engine)
    engine.dispose()
    assert dump(url) == before


@pytest.mark.slow
def test_two_upgrades_at_once_are_one(databases: Databases, tmp_path):
    url = old_store(databases, tmp_path, OLD[0])
    alone = databases.copy(url)
    assert pyroshock("db", "upgrade", "--db", alone).exit_code == 0
    both = [start_cli("db", "upgrade", "--db", url) for _ in range(2)]
    ends = [process.communicate(timeout=100) for process in both]
    assert [process.returncode for process in both] == [0, 0], ends
    assert content(url) == content(alone)


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
    "jobs", "export impacts --out impacts.csv", "materials", "db check",
    # The rest of a group whose first command is above.
    "campaigns deleted", "campaigns delete spring --reason r",
    "campaigns archive spring --out spring.pyroshock --reason r",
    "campaigns restore target.csv", "runs discard spring 1.npz --reason r",
    "runs replace spring 1.npz --from . --reason r",
    "plans list", "datasets list", "diagnoses list",
    "db backup kept", "models recover",
    "db upgrade", "db export spring --out spring.pyroshock", "db import target.csv",
    "plan quality autumn", "plan list",
)  # fmt: skip
#: These open no store, or one of their own.
WITHOUT_STORE = {"calibrate", "models", "srs", "blind-check", "demo"}


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
