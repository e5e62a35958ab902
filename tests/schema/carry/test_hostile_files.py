"""A file from elsewhere that is not what an export writes is refused, and the store stays as it was."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing

import pytest
from pyroshock.schema.engine import StoreError
from pyroshock.schema.session import count_rows
from pyroshock.schema.transfer.export import export_campaign
from pyroshock.schema.transfer.merging import import_file
from support.stores.care_stores import HAMMER, execute, flip
from support.stores.hammer_stores import url_of
from support.stores.stores import opened


@pytest.fixture(scope="module")
def template(care_source):
    file = care_source / "template.pyroshock"
    with opened(url_of(care_source / "lab.db")) as store:
        export_campaign(store, HAMMER, file)
    return file


@pytest.fixture
def file(template, tmp_path):
    return shutil.copyfile(template, tmp_path / "x.pyroshock")


@pytest.fixture
def store(sqlite_url):
    with opened(sqlite_url, create=True) as store:
        yield store


def refused(store, file, words):
    before = count_rows(store)
    with pytest.raises(StoreError, match=words):
        import_file(store, file)
    assert count_rows(store) == before


def deep(levels):
    return "[" * levels + "]" * levels


#: What is done to the file -> words of the refusal. None of these runs when the file is only opened.
STATEMENTS = {
    "CREATE TRIGGER t AFTER INSERT ON impacts BEGIN DELETE FROM impacts; END": "holds the trigger 't'",
    "CREATE VIEW v AS SELECT * FROM impacts": "holds the view 'v'",
    "CREATE TABLE extra (a)": "table 'extra' is unknown",
    "CREATE VIRTUAL TABLE f USING fts5(a)": "holds the table",
    "ALTER TABLE hammers ADD COLUMN more INTEGER": "table hammers has other columns",
    "ALTER TABLE hammers ADD COLUMN more AS (abs(mass_kg))": "table hammers has other columns",
    "DROP TABLE mode_shapes": "table 'mode_shapes' is missing",
    "UPDATE alembic_version SET version_num = '0002'": r"revision 0002, older.*pyroshock db upgrade --db sqlite:///",
    "UPDATE alembic_version SET version_num = '9999'": "9999.*update pyroshock",
    "DROP TABLE alembic_version": "no file of pyroshock db export",
    "UPDATE impacts SET configuration_id = 99 WHERE id = 1": "references: table impacts, row 1: configuration_id is 99",
    "UPDATE hammers SET mass_kg = 'heavy'": "values: table hammers: 1 rows hold no number",
    "UPDATE campaigns SET name = 'two' || char(10) || 'lines'": "names: table campaigns: name is 'two",
    "UPDATE recordings SET path = '../../etc/passwd' WHERE id = 1": "leads out of the campaign's folder",
    "UPDATE diagnoses SET report = :deep": "names: table diagnoses: report cannot be read: RecursionError",
    "UPDATE diagnoses SET report = '[]'": "names: table diagnoses: report has not the form",
    "UPDATE pulses SET force_points_n = '[1, \"two\"]' WHERE id = 1": "names: table pulses: force_points_n has not",
    "UPDATE hammers SET mass_kg = 9": "fingerprints: table hammers",
    "UPDATE channels SET chunk_samples = 100000000, samples = 300000000 WHERE id = 1": "samples in chunks of 100000000",
    "UPDATE channels SET dtype = 'O' WHERE id = 1": "its dtype is 'O'",
    "UPDATE channels SET sha256 = :zeros WHERE id = 1": "its samples have the SHA-256",
    "UPDATE series_chunks SET frame = zeroblob(100000000) WHERE channel_id = 1 AND number = 0": "too big",
    "UPDATE pulses SET contact_time_s = 1e9, fine_period_s = 0 WHERE id = 1": "points of its fine force do not fit",
    "UPDATE impacts SET run = -5 WHERE id = 1": "refused.*ck_impacts_run_not_negative",
    "UPDATE materials SET density_kg_m3 = -1, name = 'foam' WHERE name = 'delrin'": "ck_materials_density_positive",
}  # fmt: skip


#: One for each way of finding it; the others are slow only by their number.
_DEFAULT = ("CREATE TRIGGER", "CREATE TABLE", "UPDATE hammers SET mass_kg = 9", "UPDATE channels SET sha256")


@pytest.mark.parametrize(
    "statement",
    [pytest.param(each, marks=[] if each.startswith(_DEFAULT) else pytest.mark.slow) for each in STATEMENTS],
)
def test_what_no_export_writes_is_refused(store, file, statement):
    given = {"deep": deep(900), "zeros": "0" * 64}
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("PRAGMA ignore_check_constraints = ON")
        connection.execute(statement, {key: value for key, value in given.items() if f":{key}" in statement})
    refused(store, file, STATEMENTS[statement])


def test_a_frame_that_declares_gigabytes_is_not_unpacked(store, file):
    flip(url_of(file), "series_chunks", "frame", "channel_id = 1 AND number = 0", 7)
    refused(store, file, r"series: campaign spring, recording .*, channel force, chunk 0")


@pytest.mark.parametrize(
    "content", [b"", b"SQLite format 3\x00", b"PK\x03\x04" + b"x" * 9000, b"SQLite format 3\x00" * 999]
)
def test_what_is_no_database_is_refused(store, tmp_path, content):
    (tmp_path / "x").write_bytes(content)
    refused(store, tmp_path / "x", r"cannot be read|no file of pyroshock db export")


@pytest.mark.slow
def test_a_torn_file_is_refused(store, file):
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    refused(store, file, "is refused|cannot be read")


@pytest.mark.slow
def test_an_import_does_not_touch_the_file(store, file):
    before = (file.read_bytes(), file.stat().st_mtime_ns)
    import_file(store, file)
    assert (file.read_bytes(), file.stat().st_mtime_ns) == before
    assert [each.name for each in file.parent.glob("x.pyroshock*")] == ["x.pyroshock"]


@pytest.mark.slow
def test_keys_of_the_file_are_not_those_of_the_store(store, file):
    execute(url_of(file), "UPDATE hammers SET id = 70", "UPDATE campaigns SET hammer_id = 70", keys=False)
    import_file(store, file)
    with store.reading() as session:
        assert session.connection().exec_driver_sql("SELECT id FROM hammers").scalar_one() == 1
