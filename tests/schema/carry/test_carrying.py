"""A campaign in a file: whole, once, in another laboratory's store; what no export writes is
refused."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing

import pytest
from pyroshock.schema.benches import Material
from pyroshock.schema.campaign_rows import members
from pyroshock.schema.campaigns import Campaign, PlannedRun
from pyroshock.schema.engine import StoreError
from pyroshock.schema.impacts import Impact, Pulse
from pyroshock.schema.provenance import Provenance
from pyroshock.schema.recordings import Recording
from pyroshock.schema.run_states import run_status
from pyroshock.schema.session import count_rows
from pyroshock.schema.tables import metadata
from pyroshock.schema.transfer.export import export_campaign, opened_file
from pyroshock.schema.transfer.merge_rules import COUNTS, RULES, STAY_BEHIND, WRITERS
from pyroshock.schema.transfer.merging import import_file, merge
from sqlalchemy import func, select, text
from support.stores.care_stores import GUN, HAMMER, OTHER, care_folder, execute, flip
from support.stores.hammer_stores import url_of
from support.stores.stores import content, ingested, opened

#: What another laboratory's store has of its own, whatever it imports.
_SEEDED = {"materials", "material_aliases", WRITERS, COUNTS}


def exported(url, file, campaign=HAMMER):
    with opened(url) as store:
        export_campaign(store, campaign, file)
    return file


def imported(url, file):
    with opened(url, create=True) as store:
        return import_file(store, file)


@pytest.fixture
def spring(care_source, tmp_path):
    """The campaign's file, made once: a copy."""
    made = care_source / "spring.pyroshock"
    if not made.exists():
        exported(url_of(care_source / "lab.db"), made)
    return shutil.copyfile(made, tmp_path / made.name)


def counted(url):
    with opened(url, create=True) as store:
        return count_rows(store)


def test_every_table_is_carried_or_stays_behind():
    carried = set(members(1))
    assert carried == {rule.table for rule in RULES}
    assert carried | STAY_BEHIND | {WRITERS, COUNTS} == set(metadata.tables)


def test_a_file_is_a_store_of_that_campaign_alone(care_source, spring):
    of_file, of_store = content(url_of(spring)), content(url_of(care_source / "lab.db"))
    assert all(set(of_file[name]) <= set(rows) for name, rows in of_store.items())
    assert (len(of_file["campaigns"]), len(of_file["impacts"]), len(of_file["pulses"])) == (
        1,
        10,
        20,
    )
    assert {name for name, rows in of_file.items() if not rows} - STAY_BEHIND - {COUNTS} == {
        "guns",
        "shots",
    }
    assert not any(counted(url_of(spring))[name] for name in STAY_BEHIND)


@pytest.mark.slow
def test_a_file_is_one_file(care_copy, tmp_path):
    exported(care_copy, tmp_path / "one.pyroshock")
    assert [file.name for file in tmp_path.glob("one.pyroshock*")] == ["one.pyroshock"]


def test_another_laboratory_gets_all_of_it_once(spring, database_url):
    report = imported(database_url, spring)
    assert report.campaigns == (HAMMER,)
    theirs, ours = content(url_of(spring)), content(database_url)
    assert {name for name in theirs if theirs[name] != ours[name]} <= _SEEDED
    before = counted(database_url)
    assert imported(database_url, spring).added == {}
    assert counted(database_url) == before


@pytest.mark.slow
def test_a_file_from_the_server_is_the_file_of_an_sqlite_store(care_store, spring, tmp_path):
    if care_store.startswith("sqlite"):
        pytest.skip("the fixture's own file")
    assert content(url_of(exported(care_store, tmp_path / "x.pyroshock"))) == content(
        url_of(spring)
    )


@pytest.mark.slow
def test_rows_keep_who_wrote_them_and_the_import_leaves_its_own_trace(spring, sqlite_url):
    execute(url_of(spring), "UPDATE provenance SET host = 'bench-pc'", sealed=True)
    imported(sqlite_url, spring)
    with opened(sqlite_url) as store, store.reading() as session:
        query = select(Provenance.host).join(Campaign, Campaign.written_by_id == Provenance.id)
        assert session.scalars(query).all() == ["bench-pc"]
        assert session.scalar(select(func.count()).where(Provenance.command == "test")) >= 1


def test_a_campaign_that_is_there_in_part_is_completed(care_source, spring, database_url, tmp_path):
    """Another laboratory has ingested the folder itself, one recording of it cut short."""
    folder = care_folder(tmp_path / "spring")
    torn = folder / "recordings" / "test-02.mat"
    torn.write_bytes(torn.read_bytes()[:2000])
    ingested(database_url, folder)
    with opened(database_url) as store, store.reading() as session:
        assert sorted(session.scalars(select(Recording.status))) == ["set aside", "stored"]
    report = imported(database_url, spring)
    assert (report.added["impacts"], report.added["channels"], report.added["pulses"]) == (5, 2, 15)
    assert "recordings" not in report.added  # the one that was set aside has become the whole one
    with opened(database_url) as store, store.reading() as session:
        assert set(session.scalars(select(Recording.status))) == {"stored"}
        in_use = select(Impact.run, Pulse.settings_id).join(Pulse).where(Pulse.current).distinct()
        # What was in use here stays so; of the new recording it is what the others use.
        assert len(session.execute(in_use).all()) == 2
        assert session.scalar(select(func.count()).where(Impact.planned_run_id.is_(None))) == 0
        assert set(session.scalars(select(run_status()).where(PlannedRun.run < 3))) == {"done"}
    assert imported(database_url, spring).added == {}


#: What the importing store has changed -> words of the refusal.
OTHERS = {
    "UPDATE materials SET density_kg_m3 = 7850 WHERE name = 'steel'":
        r"material \(name 'steel'\) .*density_kg_m3 is 7850\.0 here, 7800\.0 in the file",
    "UPDATE campaigns SET fingerprint = 'other'": (
        r"campaign \(name 'spring'\) is another one.*a store of its own"
    ),
    "UPDATE plans SET seed = 3": r"plan \(name 'spring'\) .*seed is 3 here",
    "UPDATE factors SET si_unit = 'mm' WHERE si_unit = 'm'": (
        r"factor \(name 'tip_radius'\) .*si_unit is 'mm' here"
    ),
    "UPDATE recordings SET sha256 = :other WHERE id = 1": (
        r"recording \(path 'recordings/test-01\.npz'\) .*sha256"
    ),
    "UPDATE impacts SET impact_velocity_m_s = 9 WHERE id = 3": (
        r"impact \(run 1, repetition 3\) .*city is 9\.0 here"
    ),
    "UPDATE planned_runs SET position = 9 WHERE run = 3": (
        r"planned run \(run 3\) is another one.*position is 9 here"
    ),
    "UPDATE material_aliases SET alias = 'Delrin' WHERE id = 1": (
        r"material 'delrin' of the file is another name of"
    ),
}  # fmt: skip


def test_another_thing_under_the_same_name_is_refused_with_both(care_copy, spring):
    with opened(care_copy) as store, opened_file(spring) as origin:
        for statement, words in OTHERS.items():
            given = {"other": "0" * 64} if ":other" in statement else {}
            with pytest.raises(StoreError, match=words), store.writing() as session:
                session.execute(text(statement), given)
                merge(store, session, origin)  # what it raises takes the change back
        with store.writing() as session:
            assert merge(store, session, origin) == {}


@pytest.mark.slow
def test_a_material_of_ones_own_is_carried(care_copy, tmp_path, sqlite_url):
    execute(care_copy, "UPDATE materials SET name = 'PEEK', source = 'own' WHERE name = 'delrin'")
    execute(
        care_copy, "UPDATE factor_levels SET label = 'PEEK' WHERE label = 'delrin'", sealed=True
    )
    with pytest.raises(StoreError, match="fingerprints: table configurations"):
        imported(sqlite_url, exported(care_copy, tmp_path / "x.pyroshock"))
    imported(sqlite_url, exported(care_copy, tmp_path / "gun.pyroshock", GUN))
    with opened(sqlite_url) as store, store.reading() as session:
        assert set(session.scalars(select(Campaign.name))) == {GUN}
        assert "PEEK" not in set(session.scalars(select(Material.name)))


@pytest.mark.slow
def test_campaigns_come_one_after_another(care_source, spring, tmp_path, sqlite_url):
    for name in (GUN, OTHER):
        imported(sqlite_url, exported(url_of(care_source / "lab.db"), tmp_path / name, name))
    imported(sqlite_url, spring)
    both = content(url_of(care_source / "lab.db"))
    mine = content(sqlite_url)
    assert {name for name in both if both[name] != mine[name]} <= STAY_BEHIND | _SEEDED


def test_a_damaged_campaign_is_not_exported_and_no_file_written_over(care_copy, tmp_path):
    execute(care_copy, "DELETE FROM series_chunks WHERE channel_id = 1 AND number = 1")
    with pytest.raises(
        StoreError, match=r"campaign spring is not whole.*test-01\.npz, channel force, chunk 1"
    ):
        exported(care_copy, tmp_path / "x.pyroshock")
    assert list(tmp_path.glob("x.pyroshock*")) == []
    exported(care_copy, tmp_path / "gun.pyroshock", GUN)
    (tmp_path / "x").write_text("mine")
    with pytest.raises(StoreError, match="is there already"):
        exported(care_copy, tmp_path / "x", GUN)
    assert (tmp_path / "x").read_text() == "mine"


@pytest.fixture
def store(sqlite_url):
    with opened(sqlite_url, create=True) as store:
        yield store


def refused(store, path, words):
    before = count_rows(store)
    with pytest.raises(StoreError, match=words):
        import_file(store, path)
    assert count_rows(store) == before


def deep(levels):
    return "[" * levels + "]" * levels


#: What is done to the file -> words of the refusal. None of these runs when the file is only
#: opened.
STATEMENTS = {
    "CREATE TRIGGER t AFTER INSERT ON impacts BEGIN DELETE FROM impacts; END": (
        "holds the trigger 't'"
    ),
    "CREATE VIEW v AS SELECT * FROM impacts": "holds the view 'v'",
    "CREATE TABLE extra (a)": "table 'extra' is unknown",
    "CREATE VIRTUAL TABLE f USING fts5(a)": "holds the table",
    "ALTER TABLE hammers ADD COLUMN more INTEGER": "table hammers has other columns",
    "ALTER TABLE hammers ADD COLUMN more AS (abs(mass_kg))": "table hammers has other columns",
    "DROP TABLE mode_shapes": "table 'mode_shapes' is missing",
    "UPDATE alembic_version SET version_num = '0002'": (
        "revision 0002, older than 0013.*ingest its campaign folders into a new store"
    ),
    "UPDATE alembic_version SET version_num = '9999'": "9999.*update pyroshock",
    "DROP TABLE alembic_version": "no file of pyroshock db export",
    "UPDATE impacts SET configuration_id = 99 WHERE id = 1": (
        "references: table impacts, row 1: configuration_id is 99"
    ),
    "UPDATE hammers SET mass_kg = 'heavy'": "values: table hammers: 1 rows hold no number",
    "UPDATE campaigns SET name = 'two' || char(10) || 'lines'": (
        "names: table campaigns: name is 'two"
    ),
    "UPDATE recordings SET path = '../../etc/passwd' WHERE id = 1": (
        "leads out of the campaign's folder"
    ),
    "UPDATE diagnoses SET report = :deep": (
        "names: table diagnoses: report cannot be read: RecursionError"
    ),
    "UPDATE diagnoses SET report = '[]'": "names: table diagnoses: report has not the form",
    "UPDATE pulses SET force_points_n = '[1, \"two\"]' WHERE id = 1": (
        "names: table pulses: force_points_n has not"
    ),
    "UPDATE hammers SET mass_kg = 9": "fingerprints: table hammers",
    "UPDATE channels SET chunk_samples = 100000000, samples = 300000000 WHERE id = 1": (
        "samples in chunks of 100000000"
    ),
    "UPDATE channels SET dtype = 'O' WHERE id = 1": "its dtype is 'O'",
    "UPDATE channels SET sha256 = :zeros WHERE id = 1": "its samples have the SHA-256",
    "UPDATE series_chunks SET frame = zeroblob(100000000) WHERE channel_id = 1 AND number = 0": (
        "too big"
    ),
    "UPDATE pulses SET contact_time_s = 1e9, fine_period_s = 0 WHERE id = 1": (
        "points of its fine force do not fit"
    ),
    "UPDATE impacts SET run = -5 WHERE id = 1": "refused.*ck_impacts_run_not_negative",
    "UPDATE materials SET density_kg_m3 = -1, name = 'foam' WHERE name = 'delrin'": (
        "ck_materials_density_positive"
    ),
}  # fmt: skip


#: One for each way of finding it; the others are slow only by their number.
_DEFAULT = (
    "CREATE TRIGGER",
    "CREATE TABLE",
    "UPDATE hammers SET mass_kg = 9",
    "UPDATE channels SET sha256",
)


@pytest.mark.parametrize(
    "statement",
    [
        pytest.param(each, marks=[] if each.startswith(_DEFAULT) else pytest.mark.slow)
        for each in STATEMENTS
    ],
)
def test_what_no_export_writes_is_refused(store, spring, statement):
    given = {"deep": deep(900), "zeros": "0" * 64}
    with closing(sqlite3.connect(spring)) as connection, connection:
        connection.execute("PRAGMA ignore_check_constraints = ON")
        connection.execute(
            statement, {key: value for key, value in given.items() if f":{key}" in statement}
        )
    if statement.startswith("UPDATE") and "alembic" not in statement:
        execute(url_of(spring), sealed=True)  # so that each check has to find it by itself
    refused(store, spring, STATEMENTS[statement])


def test_a_frame_that_declares_gigabytes_is_not_unpacked(store, spring):
    flip(url_of(spring), "series_chunks", "frame", "channel_id = 1 AND number = 0", 7)
    refused(store, spring, r"series: campaign spring, recording .*, channel force, chunk 0")


@pytest.mark.parametrize(
    "content",
    [b"", b"SQLite format 3\x00", b"PK\x03\x04" + b"x" * 9000, b"SQLite format 3\x00" * 999],
)
def test_what_is_no_database_is_refused(store, tmp_path, content):
    (tmp_path / "x").write_bytes(content)
    refused(store, tmp_path / "x", r"cannot be read|no file of pyroshock db export")


@pytest.mark.slow
def test_an_import_does_not_touch_the_file_and_a_torn_one_is_refused(store, spring):
    before = (spring.read_bytes(), spring.stat().st_mtime_ns)
    import_file(store, spring)
    assert (spring.read_bytes(), spring.stat().st_mtime_ns) == before
    assert [neighbour.name for neighbour in spring.parent.glob("spring.pyroshock*")] == [
        "spring.pyroshock"
    ]
    spring.write_bytes(spring.read_bytes()[: spring.stat().st_size // 2])
    refused(store, spring, "is refused|cannot be read")


@pytest.mark.slow
def test_keys_of_the_file_are_not_those_of_the_store(store, spring):
    execute(
        url_of(spring),
        "UPDATE hammers SET id = 70",
        "UPDATE campaigns SET hammer_id = 70",
        keys=False,
        sealed=True,
    )
    import_file(store, spring)
    with store.reading() as session:
        assert session.connection().exec_driver_sql("SELECT id FROM hammers").scalar_one() == 1
