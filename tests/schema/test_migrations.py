"""A store of every revision that can be upgraded is used as a new one, and the tables that the
migrations make are the models'."""

from __future__ import annotations

import pytest
from click.testing import CliRunner
from pyroshock.app.doors.command_line.main import main
from pyroshock.app.operations.diagnose.report import page
from pyroshock.app.operations.diagnose.stored import kept_verdict
from pyroshock.schema import migrate
from pyroshock.schema.access.permissions import missing_rights
from pyroshock.schema.diagnoses import Diagnosis
from pyroshock.schema.integrity.checking import checks, iter_findings
from pyroshock.schema.listings import iter_impacts, iter_shots
from pyroshock.schema.recordings import RecordedChannel
from pyroshock.schema.series import layout_of, read_slice, series_hash
from pyroshock.schema.session import StoreVersionError, Writer, make_engine, open_store
from pyroshock.schema.tables import metadata
from sqlalchemy import MetaData, inspect, select
from support.records.campaigns import gun_campaign, hammer_campaign
from support.stores.many_databases import Files, on_server
from support.stores.stored_databases import stored_database
from support.stores.stores import counts, ingested, pyroshock, run_pyroshock

WRITER = Writer("test", "0")


@pytest.fixture(params=migrate.known_revisions())
def revision(request):
    return request.param


@pytest.fixture(params=["sqlite", "postgresql"])
def stored_url(request, revision, tmp_path):
    """A store that the software of that revision made, upgraded."""
    if request.param == "sqlite":
        url = stored_database(Files(tmp_path), tmp_path, revision)
        run_pyroshock("db", "upgrade", "--db", url)
        yield url
        return
    with on_server(request.getfixturevalue("postgres_url")) as databases:
        url = stored_database(databases, tmp_path, revision)
        run_pyroshock("db", "upgrade", "--db", url)
        yield url


def test_a_stored_database_is_read_checked_and_takes_a_campaign(stored_url, tmp_path):
    with open_store(stored_url, WRITER) as store:
        assert migrate.differences(store.engine) == []
        with store.reading() as session:
            impacts = list(iter_impacts(session, "stored"))
            hits = [(impact["run"], impact["repetition"]) for impact in impacts]
            assert hits == [(1, 1), (1, 2), (2, 1), (2, 2)]
            assert all(200 < impact["peak_force_n"] < 900 for impact in impacts)
            assert len(list(iter_shots(session, "first-shots"))) == 5
            for channel in session.scalars(select(RecordedChannel)):
                layout = layout_of(channel)
                samples = read_slice(session.connection(), channel.id, layout, 0, channel.samples)
                assert series_hash(samples) == channel.sha256
        if store.engine.dialect.name == "postgresql":
            with store.engine.connect() as connection:
                assert missing_rights(connection) == []
    _assert_sound(stored_url)
    rows = counts(stored_url)
    ingested(stored_url, hammer_campaign(tmp_path / "hammer"), gun_campaign(tmp_path / "gun"))
    added = {name: rows[name] + new for name, new in (("impacts", 4), ("shots", 3))}
    assert {name: counts(stored_url)[name] for name in added} == added
    _assert_sound(stored_url)


def _assert_sound(url):
    """By `db check`, which also looks for the registered model: its registry is elsewhere."""
    lines = pyroshock("db", "check", "--db", url).stdout.splitlines()
    assert [line.partition(":")[0] for line in lines] == ["models"]


def test_a_diagnosis_without_details_says_to_diagnose_again(stored_url):
    drawn, message = [], r"diagnose again \(pyroshock diagnose first-shots\)"
    with open_store(stored_url, WRITER) as store, store.reading() as session:
        for row in session.scalars(select(Diagnosis).order_by(Diagnosis.id)):
            if row.details is None:
                with pytest.raises(LookupError, match=message):
                    kept_verdict(session, row.id)
            else:
                drawn.append(page(kept_verdict(session, row.id)))
    assert len(drawn) == 1


def test_an_altered_row_of_a_stored_database_is_found(stored_url):
    with open_store(stored_url, WRITER) as store:
        with store.engine.begin() as connection:
            connection.exec_driver_sql(
                "UPDATE pulses SET peak_force_n = peak_force_n + 1 WHERE id = 2"
            )
            connection.exec_driver_sql("UPDATE shots SET measured_velocity_m_s = 1 WHERE id = 3")
        with store.reading() as session:
            findings = list(iter_findings(session.connection(), checks()))
    assert [finding.place["table"] for finding in findings] == ["pulses", "shots"]
    assert all("the row was altered" in finding.message for finding in findings)


def _made_by_the_engine(engine):
    """What an engine tells of its tables, columns by name. Their order is no part of the models,
    nor are defaults: the sequences of keys on PostgreSQL (`row_keys`)."""
    inspector = inspect(engine)

    def parts(table):
        columns = inspector.get_columns(table)
        indexes = inspector.get_indexes(table)
        return {
            "columns": {c["name"]: (str(c["type"]), c["nullable"]) for c in columns},
            "key": inspector.get_pk_constraint(table),
            "references": sorted(map(repr, inspector.get_foreign_keys(table))),
            "unique": sorted(map(repr, inspector.get_unique_constraints(table))),
            "checks": sorted(map(repr, inspector.get_check_constraints(table))),
            "indexes": sorted(map(_index, indexes)),
        }

    return {table: parts(table) for table in metadata.tables}


def _index(index):
    """With its condition as text, whose object says nothing."""
    options = {name: str(option) for name, option in index.get("dialect_options", {}).items()}
    return repr({**index, "dialect_options": options})


def test_the_tables_of_the_migrations_are_those_of_the_models(new_database):
    """With check constraints and conditions of indexes, which Alembic does not compare."""
    migrated, modelled = make_engine(new_database()), make_engine(new_database())
    migrate.upgrade(migrated)
    metadata.create_all(modelled)
    assert migrate.known_revisions()[-1] == migrate.HEAD
    assert migrate.differences(migrated) == []
    assert _made_by_the_engine(migrated) == _made_by_the_engine(modelled)
    there = MetaData()
    there.reflect(migrated)
    assert set(there.tables) == {*metadata.tables, "alembic_version"}
    migrated.dispose()
    modelled.dispose()


def test_newer_store_is_refused_and_an_older_one_names_the_command(database_url, monkeypatch):
    open_store(database_url, WRITER, create=True).close()
    with monkeypatch.context() as patch:
        patch.setattr(migrate, "HEAD", "9998")
        with pytest.raises(StoreVersionError, match="pyroshock db upgrade --db"):
            open_store(database_url, WRITER)
    _set_revision(database_url, "9999")
    with pytest.raises(StoreVersionError, match=r"9999.*update pyroshock"):
        open_store(database_url, WRITER)
    result = CliRunner().invoke(main, ["db", "upgrade", "--db", database_url])
    assert result.exit_code == 2
    assert "update pyroshock" in result.stderr


@pytest.mark.parametrize("revision", ["0001", "0012"])
def test_a_store_older_than_the_first_revision_is_refused_with_the_cure(database_url, revision):
    open_store(database_url, WRITER, create=True).close()
    _set_revision(database_url, revision)
    refusal = rf"is at revision {revision}, older than 0013.*ingest its campaign folders into a new"
    with pytest.raises(StoreVersionError, match=refusal):
        open_store(database_url, WRITER)
    result = CliRunner().invoke(main, ["db", "upgrade", "--db", database_url])
    assert result.exit_code == 2
    assert f"is at revision {revision}, older than 0013" in result.stderr


def _set_revision(url, revision):
    engine = make_engine(url)
    with engine.begin() as connection:
        connection.exec_driver_sql(f"UPDATE alembic_version SET version_num = '{revision}'")
    engine.dispose()
