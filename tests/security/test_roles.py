"""Reader, operator and admin of a store on PostgreSQL, tried as logins that have them."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from pyroshock.app.jobs.claims import stop
from pyroshock.app.jobs.known_kinds import KINDS
from pyroshock.app.jobs.queue import ask
from pyroshock.schema import migrate
from pyroshock.schema.access import roles
from pyroshock.schema.access.permissions import (
    ROLES,
    missing_rights,
    missing_roles,
    rights_on,
    tables_of,
)
from pyroshock.schema.access.roles import act_as_owner, ensure_roles
from pyroshock.schema.engine import StoreRoleError, make_engine
from pyroshock.schema.session import StoreError, count_rows
from pyroshock.schema.tables import metadata
from sqlalchemy import text
from sqlalchemy.exc import ProgrammingError
from support.records.campaigns import hammer_campaign, recording_name
from support.stores import later_revision
from support.stores.roled_servers import ADMIN, NOBODY, OPERATOR, PLAN, READER, Server, roled_server
from support.stores.stores import counts, opened, pyroshock, refusal, run_pyroshock
from support.stores.web_stores import FACTORS


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with roled_server(tmp_path_factory.mktemp("lab")) as found:
        yield found


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A server's store keeps its models in the current folder."""
    monkeypatch.chdir(tmp_path)
    Path("factors.toml").write_text(FACTORS)


def done(*words: str | Path) -> str:
    return run_pyroshock(*words).stdout


def test_every_table_has_its_rights_and_no_role_has_more(server: Server) -> None:
    """A migration that makes a table without them fails here."""
    with opened(server.address("keeper")) as store, store.engine.connect() as connection:
        assert set(metadata.tables) < set(tables_of(connection))
        assert missing_roles(connection) == [] and missing_rights(connection) == []
    with opened(server.address("keeper")) as store, store.engine.connect() as connection:
        query = (
            "SELECT role, tablename, has_right FROM pg_tables, unnest(ARRAY['pyroshock_reader', "
            "'pyroshock_operator']) role, "
            "unnest(ARRAY['SELECT','INSERT','UPDATE','DELETE','TRUNCATE','REFERENCES','TRIGGER']) "
            "has_right WHERE schemaname = 'public' AND has_table_privilege(role::name, "
            "tablename::text, has_right)"
        )
        granted = {tuple(row) for row in connection.execute(text(query))}
        rights = [
            (role, table, right)
            for table in tables_of(connection)
            for role, right in rights_on(table)
        ]
    assert granted == {row for row in rights if row[0] != "pyroshock_admin"}


@pytest.mark.parametrize("words", [
    ("ingest", "folder"),
    ("plan", "factorial", "mine", "--factors", "factors.toml", "--repetitions", "1"),
    ("extract", "spring", "--threshold", "0.02"),
    ("materials", "add", "lead", "--youngs-modulus", "16GPa", "--poisson-ratio", "0.44",
     "--density", "11340kg/m3", "--yield-strength", "12MPa", "--source", "a table"),
], ids=lambda words: words[0])  # fmt: skip
def test_a_reader_is_told_which_role_writes(server: Server, words: tuple[str, ...]) -> None:
    hammer_campaign(Path("folder"), recordings=1, hits=1, name="mine")
    message = refusal(*words, "--db", server.address(READER))
    assert "permission denied" in message
    assert (
        "needs the role pyroshock_operator: an administrator runs GRANT "
        'pyroshock_operator TO "rita"' in message
    )


def test_a_reader_looks_and_is_told_the_role_that_is_needed(server: Server, tmp_path: Path) -> None:
    with opened(server.address("keeper")) as store:
        asked = KINDS["extract"].read({"campaign": "spring"})
        job = ask(store, KINDS["extract"], "pulses of spring", asked)
        result = pyroshock("work", "--db", server.address(READER))
        stop(store, job.key)
    assert (
        result.exit_code == 2
        and "needs the role pyroshock_operator" in result.stderr.splitlines()[-1]
    )
    assert 'GRANT pyroshock_reader TO "nora"' in refusal(
        "campaigns", "--db", server.address(NOBODY)
    )
    with (
        opened(server.address(READER)) as store,
        pytest.raises(StoreError) as caught,
        store.reading() as session,
    ):
        session.execute(text("SELECT nothing FROM nowhere"))
    assert not isinstance(caught.value, StoreRoleError) and "pyroshock_" not in str(caught.value)
    db, before = server.address(READER), counts(server.address("keeper"))
    assert json.loads(done("impacts", "--campaign", "spring", "--db", db, "--json"))
    assert len(json.loads(done("shots", "--db", db, "--json"))) == 5
    done("export", "pulses", "--out", tmp_path / "pulses.parquet", "--db", db)
    for words in (("show", "1"), ("init",), ("campaigns",)):
        done(*words, "--db", db)
    assert counts(server.address("keeper")) == before


def test_an_operator_works_and_mends_a_recording(server: Server, tmp_path: Path) -> None:
    db = server.address(OPERATOR)
    hammer_campaign(tmp_path / "mine", recordings=1, hits=1, name="summer")
    done("ingest", tmp_path / "mine", "--db", db, "--jobs", "1")
    done(
        "plan",
        "factorial",
        "summer-plan",
        "--db",
        db,
        "--factors",
        "factors.toml",
        "--repetitions",
        "1",
    )
    done("extract", "summer", "--threshold", "0.02", "--db", db)
    # The one thing that is deleted: the row that says why a recording was set aside.
    db = server.address(OPERATOR)
    folder = hammer_campaign(tmp_path / "broken", recordings=2, hits=1, name="broken")
    recording = folder / recording_name(1)
    whole = recording.read_bytes()
    recording.write_bytes(whole[:100])
    assert "set aside" in pyroshock("ingest", folder, "--db", db, "--jobs", "1").output
    recording.write_bytes(whole)
    done("ingest", folder, "--db", db, "--jobs", "1")
    assert len(json.loads(done("impacts", "--campaign", "broken", "--db", db, "--json"))) == 2


@pytest.mark.slow
def test_an_operator_diagnoses_and_predicts(server: Server, tmp_path: Path) -> None:
    db = server.address(OPERATOR)
    done("diagnose", "first-shots", "--db", db, "--json", tmp_path / "report.json")
    assert json.loads((tmp_path / "report.json").read_text())["causes"]
    for address in (db, server.address(READER)):
        assert json.loads(
            done("predict", "--tank-pressure", "0.5bar", "--draws", "8", "--db", address, "--json")
        )


def test_an_operator_deletes_nothing_and_brings_back_what_an_admin_has_deleted(
    server: Server, tmp_path: Path
) -> None:
    folder = hammer_campaign(tmp_path / "kept", recordings=2, hits=1, name="kept")
    db, path, out = server.address(OPERATOR), recording_name(1), tmp_path / "kept.pyroshock"
    done("ingest", folder, "--db", db, "--jobs", "1")
    before = counts(db)
    assert "pyroshock_admin" in refusal(
        "runs", "discard", "kept", path, "--reason", "r", "--db", db
    )
    assert "pyroshock_admin" in refusal("campaigns", "delete", "kept", "--reason", "r", "--db", db)
    archived = ("campaigns", "archive", "kept", "--out", out, "--reason", "r", "--db")
    assert "pyroshock_admin" in pyroshock(*archived, db).stderr and counts(db) == before
    done("runs", "discard", "kept", path, "--reason", "r", "--db", server.address(ADMIN))
    done("ingest", folder, "--again", path, "--db", db, "--jobs", "1")
    out.unlink()
    done(*archived, server.address(ADMIN))
    done("campaigns", "restore", out, "--db", db)
    assert {
        **counts(db),
        **{table: before[table] for table in ("tombstones", "provenance", "audit_rows")},
    } == before


REFUSED = (
    "DELETE FROM campaigns", "UPDATE alembic_version SET version_num = '0001'",
    "UPDATE provenance SET command = ''",
    "TRUNCATE jobs", "DROP TABLE jobs", "ALTER TABLE jobs ADD mine integer",
    "CREATE TABLE mine (id integer)",
)  # fmt: skip


def test_an_operator_changes_no_tables_and_what_an_admin_adds_is_everybodys(
    server: Server, tmp_path: Path
) -> None:
    engine = make_engine(server.address(OPERATOR))
    try:
        for statement in REFUSED:
            refusal_text = r"permission denied|must be owner"
            with pytest.raises(ProgrammingError, match=refusal_text), engine.begin() as connection:
                connection.exec_driver_sql(statement)
        undo = later_revision.install(later_revision.write_revision(tmp_path / "later"))
        try:
            with pytest.raises(StoreRoleError, match="needs the role pyroshock_admin"):
                migrate.upgrade(engine)
        finally:
            undo()
        assert "needs the role pyroshock_admin" in refusal(
            "db", "roles", "--db", server.address(OPERATOR)
        )
        assert migrate.current_revision(engine) == migrate.HEAD
    finally:
        engine.dispose()
    # As a migration to come would: its table is the admin role's, and readers and operators have
    # their rights.
    admin, reader, operator = (
        make_engine(server.address(login)) for login in (ADMIN, READER, OPERATOR)
    )
    with admin.begin() as connection:
        act_as_owner(connection)
        connection.exec_driver_sql("CREATE TABLE later (id serial PRIMARY KEY, word text)")
    with operator.begin() as connection:
        connection.exec_driver_sql("INSERT INTO later (word) VALUES ('one')")
    with reader.connect() as connection:
        assert connection.exec_driver_sql("SELECT word FROM later").scalar() == "one"
        owner = connection.exec_driver_sql(
            "SELECT tableowner FROM pg_tables WHERE tablename = 'later'"
        ).scalar()
    with admin.begin() as connection:
        connection.exec_driver_sql("DROP TABLE later")
    for engine in (admin, reader, operator):
        engine.dispose()
    assert owner == "pyroshock_admin"


def test_roles_are_granted_afterwards(server: Server) -> None:
    """Without roles a store works and says what makes them; whoever owns it gives them their
    rights, and mends them."""
    assert "no role pyroshock_reader, pyroshock_operator, pyroshock_admin" in server.said
    assert "pyroshock db roles" in server.said
    db = server.address("plain", "private")
    assert sum(counts(db).values()) > 0
    rows = json.loads(done("db", "roles", "--db", db, "--json"))
    assert {row["name"]: row["members"] for row in rows}["pyroshock_reader"] == [READER]
    done("campaigns", "--db", server.address(READER, "private"))
    with opened(db) as store:
        with store.engine.begin() as connection:
            connection.exec_driver_sql("REVOKE SELECT ON impacts FROM pyroshock_reader")
            assert missing_rights(connection) == ["pyroshock_reader: SELECT on impacts"]
        assert [role.name for role in ensure_roles(store.engine)] == list(ROLES)


def test_a_file_has_no_roles(sqlite_url: str) -> None:
    done("init", "--db", sqlite_url)
    assert "has no roles" in refusal("db", "roles", "--db", sqlite_url)


def test_two_stores_of_one_server_make_a_role_at_once(server: Server) -> None:
    """The second waits for the first, and then goes on with its role."""
    first, second = (make_engine(server.address("keeper")) for _ in range(2))
    ended: list[str] = []

    def make() -> None:
        with second.begin() as connection:
            roles._make(connection, "pyroshock_race", joined=False)
            ended.append(str(connection.exec_driver_sql("SELECT 'usable'").scalar()))

    with first.begin() as connection:
        roles._make(connection, "pyroshock_race", joined=False)
        thread = threading.Thread(target=make)
        thread.start()
        thread.join(0.3)
        assert ended == []
    thread.join(20)
    for engine in (first, second):
        engine.dispose()
    server.execute("DROP ROLE pyroshock_race")
    assert ended == ["usable"]


def test_pages_for_a_reader(server: Server) -> None:
    """Seen, and a write refused in words: 403 with the role, and nothing is stored."""
    from support.processes.web_client import post, post_json, window

    with window(server.address(READER)) as (client, store):
        before = count_rows(store)
        assert (
            client.get("/campaigns").status_code == 200
            and "spring" in client.get("/campaigns").text
        )
        address = f"/plans/{PLAN}/runs/1"
        discard = {"status": "discarded", "note": "the tip broke"}
        answers = [post_json(client, f"/api{address}", discard), post(client, address, discard)]
        assert count_rows(store) == before
    for answer in answers:
        assert answer.status_code == 403, answer.text
        assert "pyroshock_operator" in answer.text
