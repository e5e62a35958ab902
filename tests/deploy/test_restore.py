"""A backup comes back as docs/how-to/deploy-a-server.md says: a dump of PostgreSQL, and a copy of
an SQLite file."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from sqlalchemy import make_url
from support.missing import skip_for_want_of
from support.records.campaigns import hammer_campaign
from support.stores import later_revision
from support.stores.postgres_server import NoServerError, installations, running_server
from support.stores.stores import content, counts, ingested, pyroshock, refusal, run_pyroshock

ROOT = Path(__file__).resolve().parents[2]
DEPLOY = ROOT / "deploy"
PROGRAMS = ("psql", "pg_dump", "pg_restore", "dropdb")
HITS = 2


@dataclass(frozen=True)
class Server:
    """A server with the databases, roles and logins of deploy/init-databases.sh, and the shell that
    reaches it."""

    url: str
    folder: Path
    environment: dict[str, str]

    def store(self, login: str) -> str:
        """The address of the store for a login."""
        return (
            make_url(self.url)
            .set(database="pyroshock", username=login)
            .render_as_string(hide_password=False)
        )

    def run(self, script: str, folder: Path) -> str:
        """A script of the page, or of deploy/, in `folder`; what it says. Fails the test where a
        line of it fails."""
        done = subprocess.run(
            ["/bin/sh", "-euc", script],
            cwd=folder,
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server of its own, for roles and names of databases are those of the page."""
    whole = [
        each
        for each in installations()
        if all((each / "bin" / name).is_file() for name in PROGRAMS)
    ]
    if not whole:
        skip_for_want_of(
            "PostgreSQL", f"no installation that has {', '.join(PROGRAMS)} with the server"
        )
    try:
        with running_server(whole[:1]) as url:
            yield _prepared(url, whole[0] / "bin", tmp_path_factory.mktemp("deployed"))
    except NoServerError as error:
        skip_for_want_of("PostgreSQL", str(error))


def _prepared(url: str, programs: Path, folder: Path) -> Server:
    for name in ("secrets", "bin", "backups", "models"):
        (folder / name).mkdir()
    for name in ("owner_password", "lab_password"):
        (folder / "secrets" / name).write_text(f"{name} of a 'test'")
    command = folder / "bin" / "pyroshock"
    command.write_text(
        f'#!/bin/sh\nexec {sys.executable} -c "from pyroshock.app.doors.command_line.main '
        f'import main; main()" "$@"\n'
    )
    command.chmod(0o755)
    found = Server(url, folder, {})
    environment = {
        **os.environ,
        "PATH": f"{folder / 'bin'}:{programs}:{os.environ['PATH']}",
        "PGHOST": str(make_url(url).query["host"]),
        "PGUSER": "postgres",
        "SECRETS": str(folder / "secrets"),
        "BACKUPS": str(folder / "backups"),
        "MODELS": str(folder / "models"),
        "PYROSHOCK_MODELS": str(folder / "models"),
        "PYROSHOCK_DB": found.store("pyroshock_lab"),
    }
    server = Server(url, folder, environment)
    server.run(str(DEPLOY / "init-databases.sh"), folder)
    return server


@pytest.fixture
def login(server: Server) -> Iterator[Callable[[str], str]]:
    """The address of a new store for a login of the page."""
    assert pyroshock("init", "--db", server.store("pyroshock_owner")).exit_code == 0
    yield server.store
    server.run(
        """psql -q -d postgres -c 'DROP DATABASE pyroshock WITH (FORCE)' \\
            -c 'CREATE DATABASE pyroshock OWNER pyroshock_owner'""",
        server.folder,
    )


def block(heading: str, last: str) -> str:
    """The commands of the page's section that end with the line `last`."""
    section = (
        (ROOT / "docs" / "how-to" / "deploy-a-server.md")
        .read_text()
        .split(f"\n## {heading}\n")[1]
        .split("\n## ")[0]
    )
    found = [
        text
        for text in re.findall(r"```sh\n(.*?)```", section, re.DOTALL)
        if text.rstrip().endswith(last)
    ]
    assert len(found) == 1, (heading, last)
    return found[0]


DUMP = ("Backup", "--file=pyroshock.dump")
RESTORE = ("Restore", "pyroshock db check")
#: Who may log into the databases, and who owns them.
RIGHTS = (
    'psql -d postgres -Atc "SELECT datname, datdba, datacl FROM pg_database '
    """WHERE datname ~ '^pyro' ORDER BY 1" """
)


def test_night_backup_comes_back(server, login, tmp_path):
    lab, model = login("pyroshock_lab"), server.folder / "models" / "1" / "model.json"
    campaign = hammer_campaign(tmp_path / "first", 2, HITS, "first")
    ingested(lab, campaign)  # an operator may
    model.parent.mkdir()
    model.write_text("{}")
    before, rights = content(lab), server.run(RIGHTS, tmp_path)
    _old_backup(server.folder / "backups" / "2026-01-01T020000Z")
    server.run(f"{DEPLOY / 'backup.sh'} --once", tmp_path)
    (backup,) = (server.folder / "backups").iterdir()
    assert sorted(file.name for file in backup.iterdir()) == [
        "models.tar",
        "pyroshock.dump",
        "pyroshock_models.dump",
    ]
    shutil.rmtree(model.parent)
    server.run("dropdb pyroshock; dropdb pyroshock_models", backup)
    server.run(block(*RESTORE), backup)
    assert (
        content(lab) == before
        and server.run(RIGHTS, tmp_path) == rights
        and model.read_text() == "{}"
    )
    _assert_in_use(lab, campaign, tmp_path)


def _old_backup(folder: Path) -> None:
    """Of forty days ago, which are more than are kept."""
    folder.mkdir()
    then = time.time() - 40 * 86_400
    os.utime(folder, (then, then))


def _assert_in_use(url: str, campaign: Path, folder: Path) -> None:
    """What is there is known, and what is new gets keys of its own."""
    before = counts(url)
    assert pyroshock("init", "--db", url).exit_code == 0
    ingested(url, campaign)
    assert counts(url) == before
    ingested(url, hammer_campaign(folder / "second", 1, HITS, "second", seed=2))
    assert counts(url)["impacts"] == before["impacts"] + HITS


def test_dump_of_an_older_version_comes_up(server, login, tmp_path):
    owner = login("pyroshock_owner")
    campaign = hammer_campaign(tmp_path / "first", 1, HITS, "first")
    ingested(owner, campaign)
    before = content(owner)
    server.run(block(*DUMP), tmp_path)
    server.run("dropdb pyroshock", tmp_path)
    restore = block(*RESTORE).splitlines()[0]
    assert restore.endswith(" pyroshock.dump")
    server.run(restore, tmp_path)
    assert content(owner) == before
    undo = later_revision.install(later_revision.write_revision(tmp_path / "later"))
    try:
        assert "pyroshock db upgrade" in refusal("campaigns", "--db", owner)
        assert pyroshock("db", "upgrade", "--db", owner).exit_code == 0
        after = content(owner)
        for table in ("recordings", "channels", "series_chunks", "impacts", "pulses"):
            assert after[table] == before[table]
        assert after["materials"] != before["materials"]
        _assert_in_use(owner, campaign, tmp_path)
    finally:
        undo()


def test_copy_of_a_file_in_use_comes_back(tmp_path, monkeypatch):
    """`pyroshock db backup` of docs/reference/store.md, while somebody writes, and `restore`, when
    the file is gone."""
    page = (ROOT / "docs" / "reference" / "store.md").read_text()
    back_up, restore = (
        shlex.split(line, comments=True)
        for line in re.findall(r"^pyroshock (db (?:backup|restore) .+)$", page, re.M)
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    campaign = hammer_campaign(tmp_path / "first", 2, HITS, "first")
    ingested("sqlite:///lab.db", campaign)
    before = content("sqlite:///lab.db")
    writer = sqlite3.connect("lab.db", isolation_level=None)
    writer.execute("BEGIN IMMEDIATE")
    writer.execute("DELETE FROM quality_findings")
    run_pyroshock(*back_up)
    writer.close()
    for file in tmp_path.glob("lab.db*"):
        file.unlink()
    run_pyroshock(*restore)
    assert content("sqlite:///restored.db") == before
    _assert_in_use("sqlite:///restored.db", campaign, tmp_path)
