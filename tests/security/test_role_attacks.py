"""Raw series, recordings and calibration on PostgreSQL, attacked by SQL as each role: nobody but an
administrator changes or deletes them, and what the software itself must change as an operator still
works."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import psycopg
import pytest
from pyroshock.schema.engine import make_engine
from sqlalchemy import text
from support.records.campaigns import hammer_campaign, recording_name
from support.stores.roled_servers import ADMIN, NOBODY, OPERATOR, READER, Server, roled_server
from support.stores.stores import pyroshock, refusal, run_pyroshock

#: Statements of one session; {recording}, {channel}, {campaign}: keys of a stored recording, a
#: channel of it, another campaign. What one leaves open ends with the session.
ATTACKS: dict[str, tuple[str, ...]] = {
    "delete all samples": ("DELETE FROM series_chunks",),
    "delete the samples of a channel": ("DELETE FROM series_chunks WHERE channel_id = {channel}",),
    "change samples": ("UPDATE series_chunks SET frame = 'x'",),
    "renumber samples": ("UPDATE series_chunks SET number = number + 100",),
    "unseal samples": ("UPDATE series_chunks SET row_sha256 = 'unsealed'",),
    "truncate samples": ("TRUNCATE series_chunks",),
    "truncate recordings": ("TRUNCATE recordings CASCADE",),
    "samples by conflict": (
        "INSERT INTO series_chunks (channel_id, number, frame, written_by_id)"
        " SELECT channel_id, number, 'x', written_by_id FROM series_chunks"
        " ON CONFLICT (channel_id, number) DO UPDATE SET frame = 'x'",
    ),
    "samples by merge": (
        "MERGE INTO series_chunks s USING (SELECT {channel} AS id) c ON s.channel_id = c.id "
        "WHEN MATCHED THEN DELETE",
    ),
    "samples by a common table": (
        "WITH gone AS (DELETE FROM series_chunks RETURNING 1) SELECT count(*) FROM gone",
    ),
    **{
        f"change {column} of a channel": (f"UPDATE channels SET {column} = {value}",)
        for column, value in {
            "si_gain": "si_gain * 2", "si_offset": "1", "unit": "'kN'", "si_unit": "'Pa'",
            "sampling_rate_hz": "1", "start_s": "1", "sensitivity": "2", "offset_v": "1",
            "full_scale": "1", "quantity": "'pressure'", "sha256": "repeat('0', 64)",
            "samples": "1", "chunk_samples": "1", "step": "2", "dtype": "'<f4'", "name": "'x'",
            "position": "'x'", "axis": "'x'", "header": "'{{}}'",
            "recording_id": "{recording} + 1", "row_sha256": "'unsealed'",
        }.items()
    },
    "delete channels": ("DELETE FROM channels",),
    "delete recordings": ("DELETE FROM recordings",),
    "delete a recording that is called set aside": (
        "UPDATE recordings SET status = 'set aside', reason = 'x'", "DELETE FROM recordings",
    ),
    "delete a stored recording by the function": (
        "SELECT 1 / pyroshock_delete_set_aside({recording})",
    ),
    "replace a stored recording by the function": (
        "SELECT 1 / pyroshock_replace_set_aside({recording}, repeat('0', 64), 1, 'npz', "
        "'set aside', 'x', 1, 'x')",
    ),
    "delete whole samples by the function": (
        "SELECT 1 / pyroshock_delete_damaged_chunks({channel})",
    ),
    "move a recording to another campaign": ("UPDATE recordings SET campaign_id = {campaign}",),
    "move an impact to another recording": ("UPDATE impacts SET recording_id = NULL",),
    "move an impact to another campaign": ("UPDATE impacts SET campaign_id = {campaign}",),
    "rename a campaign": ("UPDATE campaigns SET name = 'x' WHERE id = {campaign}",),
    "change figures of an impact": ("UPDATE impacts SET impact_velocity_m_s = 1",),
    "change figures of a pulse": ("UPDATE pulses SET peak_force_n = 1",),
    "delete a campaign": ("DELETE FROM campaigns",),
    "delete findings": ("DELETE FROM quality_findings",),
    "soften findings": ("UPDATE quality_findings SET severity = 'note'",),
    "be somebody else": ("UPDATE provenance SET command = 'x'",),
    "forget who it was": ("DELETE FROM provenance",),
    "disable triggers": ("ALTER TABLE series_chunks DISABLE TRIGGER ALL",),
    "no triggers for a session": ("SET session_replication_role = replica",
    "DELETE FROM series_chunks"),
    "own the table": ("ALTER TABLE series_chunks OWNER TO CURRENT_USER",),
    "drop a column": ("ALTER TABLE channels DROP COLUMN si_gain",),
    "drop the table": ("DROP TABLE series_chunks CASCADE",),
    "drop a function": ("DROP FUNCTION pyroshock_delete_set_aside(integer)",),
    "another function of the name": (
        "CREATE OR REPLACE FUNCTION pyroshock_delete_set_aside(recording integer) RETURNS integer "
        "LANGUAGE sql AS 'SELECT 1'",
    ),
    "own a function": ("ALTER FUNCTION pyroshock_delete_set_aside(integer) OWNER TO CURRENT_USER",),
    "a function that looks elsewhere": (
        "ALTER FUNCTION pyroshock_delete_damaged_chunks(integer) SET search_path = pg_temp",
    ),
    "a temporary table before the real one": (
        "CREATE TEMP TABLE channels (id integer, recording_id integer, samples bigint, "
        "chunk_samples integer)",
        "CREATE TEMP TABLE recordings (id integer, status text)",
        "INSERT INTO pg_temp.channels VALUES ({channel}, -1, 0, 1)",
        "INSERT INTO pg_temp.recordings VALUES ({recording}, 'set aside')",
        "SET search_path = pg_temp, public",
        "SELECT 1 / (public.pyroshock_delete_damaged_chunks({channel})"
        " + public.pyroshock_delete_set_aside({recording}))",
    ),
    "temporary functions and operators before the real ones": (
        "CREATE FUNCTION pg_temp.sha256(bytea) RETURNS bytea LANGUAGE sql AS $$SELECT ''::bytea$$",
        "CREATE FUNCTION pg_temp.count() RETURNS bigint LANGUAGE sql AS 'SELECT 1::bigint'",
        "CREATE OPERATOR pg_temp.= (leftarg = text, rightarg = text, function = pg_catalog.textne)",
        "SET search_path = pg_temp, pg_catalog, public",
        "SELECT 1 / (public.pyroshock_delete_damaged_chunks({channel})"
        " + public.pyroshock_delete_set_aside({recording}))",
    ),
    "be the administrator": ("SET ROLE pyroshock_admin", "DELETE FROM series_chunks"),
    "be the session of another": ("SET SESSION AUTHORIZATION keeper", "DELETE FROM series_chunks"),
    "grant oneself the role": ("GRANT pyroshock_admin TO CURRENT_USER",
    "DELETE FROM series_chunks"),
    "grant oneself the right": ("GRANT DELETE ON series_chunks TO CURRENT_USER",
    "DELETE FROM series_chunks"),
    "a rule": ("CREATE RULE gone AS ON SELECT TO series_chunks DO INSTEAD SELECT 1",),
    "a trigger": (
        "CREATE FUNCTION pg_temp.nothing() RETURNS trigger LANGUAGE plpgsql "
        "AS 'BEGIN RETURN NULL; END'",
        "CREATE TRIGGER nothing BEFORE INSERT ON series_chunks FOR EACH ROW EXECUTE FUNCTION "
        "pg_temp.nothing()",
    ),
    "a policy": (
        "CREATE POLICY nobody ON series_chunks USING (false)",
        "ALTER TABLE series_chunks ENABLE ROW LEVEL SECURITY",
    ),
    "the catalogue": ("UPDATE pg_class SET relowner = 0 WHERE relname = 'series_chunks'",),
    "another schema before ours": ("CREATE SCHEMA public2",
    "ALTER TABLE series_chunks SET SCHEMA public2"),
    "lock everybody out": ("LOCK TABLE series_chunks IN ACCESS EXCLUSIVE MODE", "SELECT 1 / 0"),
    "wind a sequence back": ("SELECT setval('recordings_id_seq', 1)",),
    "do": ("DO $$ BEGIN DELETE FROM series_chunks; END $$",),
    "the revision": ("UPDATE alembic_version SET version_num = '0001'",),
}  # fmt: skip


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with roled_server(tmp_path_factory.mktemp("lab")) as served:
        yield served


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def _digest(server: Server) -> str:
    """Of all that is protected: every row of these tables, as the superuser reads them."""
    tables = (
        "recordings",
        "channels",
        "series_chunks",
        "quality_findings",
        "impacts",
        "pulses",
        "campaigns",
        "provenance",
    )
    engine = make_engine(server.address("postgres"))
    digest = hashlib.sha256()
    try:
        with engine.connect() as connection:
            for table in tables:
                rows = (
                    connection.execute(text(f"SELECT md5(t::text) FROM {table} t ORDER BY 1"))
                    .scalars()
                    .all()
                )
                digest.update(repr((table, rows)).encode())
            owners = (
                "SELECT relname, relowner, relacl::text FROM pg_class WHERE "
                "relnamespace = 'public'::regnamespace"
            )
            functions = (
                "SELECT proname, proowner, prosrc, proconfig::text, proacl::text "
                "FROM pg_proc WHERE proname ~ '^pyro'"
            )
            for query in (f"{owners} ORDER BY 1", f"{functions} ORDER BY 1"):
                digest.update(repr(connection.exec_driver_sql(query).all()).encode())
    finally:
        engine.dispose()
    return digest.hexdigest()


def _keys(server: Server) -> dict[str, Any]:
    engine = make_engine(server.address("postgres"))
    try:
        with engine.connect() as connection:
            channel, recording = connection.exec_driver_sql(
                "SELECT c.id, c.recording_id FROM channels c JOIN series_chunks s ON s.channel_id "
                "= c.id ORDER BY 1 LIMIT 1"
            ).one()
            campaign = connection.exec_driver_sql("SELECT max(id) FROM campaigns").scalar()
    finally:
        engine.dispose()
    return {"channel": channel, "recording": recording, "campaign": campaign}


def _attacked(url: str, statements: tuple[str, ...]) -> str:
    """The error that ends the attack, empty for one that goes through."""
    with closing(
        psycopg.connect(url.replace("postgresql+psycopg", "postgresql"), autocommit=True)
    ) as connection:
        try:
            for statement in statements:
                connection.execute(statement.encode())
        except psycopg.Error as error:
            return str(error).splitlines()[0]
    return ""


@pytest.mark.parametrize("login", [NOBODY, READER, OPERATOR])
def test_nobody_but_an_administrator_changes_what_was_recorded(server: Server, login: str) -> None:
    before, keys, rows = _digest(server), _keys(server), {}
    for name, statements in ATTACKS.items():
        error = _attacked(
            server.address(login), tuple(statement.format(**keys) for statement in statements)
        )
        rows[name] = (error, _digest(server) == before)
        print(f"| {login} | {name} | {'held' if all(rows[name]) else 'NOT HELD'} | {error[:90]} |")
    assert {name: row for name, row in rows.items() if not row[0] or not row[1]} == {}


def test_an_administrator_may(server: Server) -> None:
    """The exception that is promised, so that the attacks above are real ones; taken back."""
    keys = _keys(server)
    for statement in (
        "DELETE FROM series_chunks",
        "UPDATE channels SET si_gain = 2",
        "UPDATE recordings SET path = 'x' || id",
    ):
        assert (
            _attacked(server.address(ADMIN), ("BEGIN", statement.format(**keys), "ROLLBACK")) == ""
        )


def test_functions_are_their_owners_and_name_their_schema(server: Server) -> None:
    with closing(psycopg.connect(server.address("postgres").replace("+psycopg", ""))) as connection:
        rows = connection.execute(
            "SELECT proname, prosecdef, proconfig, pg_get_userbyid(proowner) "
            "FROM pg_proc WHERE proname ~ '^pyroshock_'"
        ).fetchall()
    assert len(rows) == 4
    assert {tuple(map(str, row[1:])) for row in rows} == {
        ("True", "['search_path=pg_catalog, pg_temp']", "pyroshock_admin")
    }


def test_an_operator_mends_a_damaged_series_and_no_whole_one(
    server: Server, tmp_path: Path
) -> None:
    db = server.address(OPERATOR)
    folder = hammer_campaign(tmp_path / "mended", recordings=2, hits=1, name="mended")
    run_pyroshock("ingest", folder, "--db", db, "--jobs", "1")
    of_campaign = (
        "channel_id IN (SELECT c.id FROM channels c JOIN recordings r ON r.id = c.recording_id"
        " JOIN campaigns k ON k.id = r.campaign_id WHERE k.name = 'mended')"
    )
    damages = (
        f"UPDATE series_chunks SET frame = overlay(frame PLACING 'abc'::bytea "
        f"FROM 40) WHERE {of_campaign}",
        f"DELETE FROM series_chunks WHERE number = 0 AND {of_campaign}",
        f"UPDATE series_chunks SET number = 90 WHERE {of_campaign}",
    )
    for damage in damages:
        server.execute(damage, "lab")
        assert pyroshock("db", "check", "--db", db).exit_code != 0
        result = run_pyroshock("db", "check", "--db", db, "--repair", folder)
        assert pyroshock("db", "check", "--db", db).exit_code == 0, result.output
    # What was recorded of a series is the administrator's to change.
    server.execute(
        f"UPDATE channels SET chunk_samples = 999 WHERE "
        f"{of_campaign.replace('channel_id', 'id', 1)}",
        "lab",
    )
    assert "pyroshock_admin" in pyroshock("db", "check", "--db", db, "--repair", folder).output
    run_pyroshock("db", "check", "--db", server.address(ADMIN), "--repair", folder)


def test_an_operator_imports_what_replaces_a_recording_that_was_set_aside(
    server: Server, tmp_path: Path
) -> None:
    folder = hammer_campaign(tmp_path / "both", recordings=2, hits=1, name="both")
    theirs, out, db = (
        f"sqlite:///{tmp_path}/theirs.db",
        tmp_path / "both.pyroshock",
        server.address(OPERATOR),
    )
    run_pyroshock("ingest", folder, "--db", theirs, "--jobs", "1")
    run_pyroshock("db", "export", "both", "--out", out, "--db", theirs)
    recording = folder / recording_name(1)
    recording.write_bytes(recording.read_bytes()[:100])
    assert "set aside" in pyroshock("ingest", folder, "--db", db, "--jobs", "1").output
    run_pyroshock("db", "import", out, "--db", db)
    assert pyroshock("db", "check", "--db", db).exit_code == 0
    assert "pyroshock_admin" in refusal(
        "runs", "discard", "both", recording_name(1), "--reason", "r", "--db", db
    )
