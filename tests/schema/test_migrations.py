"""Every revision's stored database comes up to this software, and the tables are the models'."""

from __future__ import annotations

import shutil
import zlib
from pathlib import Path

import pytest
from click.testing import CliRunner
from pyroshock.app.doors.command_line.main import main
from pyroshock.app.operations.diagnose.report import page
from pyroshock.app.operations.diagnose.stored import kept_verdict
from pyroshock.schema import migrate
from pyroshock.schema.diagnoses import Diagnosis
from pyroshock.schema.integrity.checking import checks, iter_findings
from pyroshock.schema.listings import iter_impacts, iter_shots
from pyroshock.schema.recordings import RecordedChannel
from pyroshock.schema.removal.part import recording_part
from pyroshock.schema.removal.removing import remove
from pyroshock.schema.series import layout_of, read_slice, series_hash
from pyroshock.schema.session import StoreVersionError, Writer, make_engine, open_store
from sqlalchemy import select, text
from sqlalchemy.exc import IntegrityError
from support.records.campaigns import gun_campaign, hammer_campaign, recording_name
from support.stores.stores import ingested, pyroshock

STORED = Path(__file__).parent / "stored"
WRITER = Writer("test", "0")


@pytest.fixture(scope="module", params=migrate.known_revisions())
def old_store(request, tmp_path_factory):
    """The stored database of one revision, upgraded, as a store's address; tests only read it."""
    file = tmp_path_factory.mktemp("upgraded") / f"{request.param}.db"
    file.write_bytes(zlib.decompress((STORED / f"{request.param}.sqlite.z").read_bytes()))
    result = CliRunner().invoke(main, ["db", "upgrade", "--db", f"sqlite:///{file}"])
    assert result.exit_code == 0, result.output
    return f"sqlite:///{file}"


def test_upgraded_store_is_used_as_a_new_one(old_store):
    with open_store(old_store, WRITER) as store:
        assert migrate.differences(store.engine) == []
        with store.reading() as session:
            impacts = list(iter_impacts(session, "stored"))
            assert [(i["run"], i["repetition"]) for i in impacts] == [
                (1, 1),
                (1, 2),
                (2, 1),
                (2, 2),
            ]
            assert all(200 < i["peak_force_n"] < 900 for i in impacts)
            assert len(list(iter_shots(session, "first-shots"))) == 5
            for channel in session.scalars(select(RecordedChannel)):
                whole = read_slice(
                    session.connection(), channel.id, layout_of(channel), 0, channel.samples
                )
                assert series_hash(whole) == channel.sha256


def _unsound(store):
    with store.reading() as session:
        return [
            (each.check, each.message) for each in iter_findings(session.connection(), checks())
        ]


def test_rows_that_were_stored_before_they_were_hashed_are_hashed_by_the_upgrade(
    database_url, tmp_path
):
    ingested(database_url, gun_campaign(tmp_path / "gun"), hammer_campaign(tmp_path / "hammer"))
    engine = make_engine(database_url)
    migrate.downgrade(engine, "0006")
    migrate.upgrade(engine)
    engine.dispose()
    with open_store(database_url, WRITER) as store:
        assert _unsound(store) == []


def test_a_store_with_known_facts_goes_back_and_forth(database_url, tmp_path):
    folder, other = gun_campaign(tmp_path / "gun"), gun_campaign(tmp_path / "other", name="other")
    with (folder / "campaign.toml").open("a", encoding="utf-8") as file:
        file.write(
            "[known]\nsensor.velocity_gain.gain = { value = 1.0, u = 0.002, "
            'source = "certificate" }\n'
        )
    ingested(database_url, folder, other)
    engine = make_engine(database_url)
    with engine.begin() as connection:
        connection.exec_driver_sql("UPDATE campaigns SET operator = 'nobody' WHERE name = 'other'")
    migrate.downgrade(engine, "0012")
    migrate.upgrade(engine)
    assert migrate.differences(engine) == []
    engine.dispose()
    with open_store(database_url, WRITER) as store:
        ((check, message),) = _unsound(store)
    assert check == "rows"
    assert "the row was altered" in message, (
        "of the campaign that was altered by hand, and of no other"
    )


def test_tombstones_of_revision_0008_stay_open_after_the_upgrade_and_keep_its_rules(
    database_url, tmp_path
):
    folder = hammer_campaign(tmp_path / "hammer")
    ingested(database_url, folder)
    with open_store(database_url, WRITER) as store, store.writing() as session:
        remove(session, recording_part(session, "hammer", recording_name(1)), "r")
    engine = make_engine(database_url)
    migrate.downgrade(engine, "0008")
    migrate.upgrade(engine)
    assert migrate.differences(engine) == []
    with pytest.raises(IntegrityError), engine.begin() as connection:
        connection.execute(
            text("UPDATE tombstones SET archive_path = 'f', archive_sha256 = :hash"),
            {"hash": "0" * 64},
        )
    engine.dispose()
    told = ingested(database_url, folder).stderr
    assert "was discarded on" in told, "by its path alone: 0008 kept no hash of the file"
    assert (
        pyroshock("ingest", folder, "--again", recording_name(1), "--db", database_url).exit_code
        == 0
    )
    with open_store(database_url, WRITER) as store:
        assert _unsound(store) == []


def test_diagnosis_of_an_older_store_says_to_diagnose_again(old_store):
    older = old_store.endswith(("0001.db", "0002.db"))
    drawn = []
    with open_store(old_store, WRITER) as store, store.reading() as session:
        for row in session.scalars(select(Diagnosis).order_by(Diagnosis.id)):
            if row.details is None:
                with pytest.raises(
                    LookupError, match=r"diagnose again \(pyroshock diagnose first-shots\)"
                ):
                    kept_verdict(session, row.id)
            else:
                drawn.append(page(kept_verdict(session, row.id)))
    assert len(drawn) == (0 if older else 1)


def test_rows_of_an_older_store_are_hashed_and_an_altered_one_is_found(old_store, tmp_path):
    copy = shutil.copy(old_store.removeprefix("sqlite:///"), tmp_path)
    with open_store(f"sqlite:///{copy}", WRITER) as store:
        assert _unsound(store) == []
        with store.engine.begin() as connection:
            connection.exec_driver_sql(
                "UPDATE pulses SET peak_force_n = peak_force_n + 1 WHERE id = 2"
            )
            connection.exec_driver_sql("UPDATE shots SET measured_velocity_m_s = 1 WHERE id = 3")
        problems = _unsound(store)
        assert [check for check, _ in problems] == ["rows", "rows"]
        assert all("the row was altered" in message for _, message in problems)


def test_figures_that_were_altered_before_rows_were_hashed_stay_findings_after_the_upgrade(
    database_url, tmp_path
):
    ingested(database_url, gun_campaign(tmp_path / "gun"), hammer_campaign(tmp_path / "hammer"))
    engine = make_engine(database_url)
    migrate.downgrade(engine, "0010")
    with engine.begin() as connection:
        connection.exec_driver_sql("UPDATE pulses SET peak_force_n = peak_force_n + 1 WHERE id = 2")
        connection.exec_driver_sql("UPDATE shots SET measured_velocity_m_s = 1 WHERE id = 1")
    migrate.upgrade(engine)
    engine.dispose()
    with open_store(database_url, WRITER) as store, store.reading() as session:
        findings = list(iter_findings(session.connection(), checks()))
    assert [(finding.place["table"], finding.place["row"]) for finding in findings] == [
        ("pulses", "2"),
        ("shots", "1"),
    ]
    assert all(
        "a figure was altered before the store was upgraded" in finding.message
        for finding in findings
    )


def test_every_migration_has_a_way_back(database_url):
    assert migrate.known_revisions()[-1] == migrate.HEAD
    engine = make_engine(database_url)
    for revision in migrate.known_revisions():
        migrate.upgrade(engine, revision)
    assert migrate.differences(engine) == []
    for revision in ["base", *migrate.known_revisions()[:-1]][::-1]:
        migrate.downgrade(engine, revision)
    assert migrate.current_revision(engine) is None
    migrate.upgrade(engine)
    assert migrate.differences(engine) == []
    engine.dispose()


def test_newer_store_is_refused_and_an_older_one_names_the_command(database_url, monkeypatch):
    open_store(database_url, WRITER, create=True).close()
    with monkeypatch.context() as patch:
        patch.setattr(migrate, "HEAD", "9998")
        with pytest.raises(StoreVersionError, match="pyroshock db upgrade --db"):
            open_store(database_url, WRITER)
    engine = make_engine(database_url)
    with engine.begin() as connection:
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = '9999'")
    engine.dispose()
    with pytest.raises(StoreVersionError, match=r"9999.*update pyroshock"):
        open_store(database_url, WRITER)
    result = CliRunner().invoke(main, ["db", "upgrade", "--db", database_url])
    assert result.exit_code == 2
    assert "update pyroshock" in result.stderr
