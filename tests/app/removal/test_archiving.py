"""`campaigns archive` and `campaigns restore`: out of the store into a file, and back as it was."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import pytest
from pyroshock.dataset.snapshot import read_snapshot
from pyroshock.schema.diagnoses import Diagnosis, TwinVersion
from pyroshock.schema.transfer.export import export_campaign, write_archive
from sqlalchemy import select
from support.records.campaigns import hammer_campaign
from support.stores.care_stores import HAMMER, WHEN, copied, execute
from support.stores.stores import content, counts, ingested, opened, pyroshock

REASON = "finished"


def run(url, *arguments, code=0):
    result = pyroshock("campaigns", *arguments, "--db", url)
    assert result.exit_code == code, result.output
    return result


def archived(url, out, name=HAMMER):
    return json.loads(run(url, "archive", name, "--out", out, "--reason", REASON, "--json").stdout)


def restored(url, file):
    return json.loads(run(url, "restore", file, "--json").stdout)


def sound(url):
    check = pyroshock("db", "check", "--db", url)
    assert check.exit_code == 0, check.stdout


def but_tombstones(url):
    return {name: rows for name, rows in content(url).items() if name != "tombstones"}


def test_archived_and_restored_campaign_is_as_before(care_store, tmp_path):
    before = but_tombstones(care_store)
    with opened(care_store) as store:
        digest = read_snapshot(store, "small").hash
    out = tmp_path / "spring.pyroshock"
    stone = archived(care_store, out)
    assert stone["archive_path"] == str(out.resolve())
    assert stone["archive_sha256"] == hashlib.sha256(out.read_bytes()).hexdigest()
    shown = pyroshock("dataset", "show", "small", "--db", care_store)
    assert shown.exit_code == 2 and f"pyroshock campaigns restore {out.resolve()}" in shown.stderr
    sound(care_store)
    back = restored(care_store, out)
    assert (back["returned"], back["notes"]) == ({"small": 10}, [])
    assert but_tombstones(care_store) == before, "also diagnoses, adopted effects, links to the plan and the dataset"
    with opened(care_store) as store:
        assert read_snapshot(store, "small").hash == digest
    assert json.loads(run(care_store, "deleted", "--json").stdout)[-1]["restored_at"] is not None
    sound(care_store)


def test_archived_again_after_it_was_restored(care_copy, tmp_path):
    first = archived(care_copy, tmp_path / "1")
    restored(care_copy, tmp_path / "1")
    second = archived(care_copy, tmp_path / "2")
    assert first["content_hash"] == second["content_hash"]
    assert restored(care_copy, tmp_path / "1")["id"] == second["id"], "any file of the content will do"
    sound(care_copy)


def test_file_of_db_export_restores_what_was_deleted(care_copy, tmp_path):
    before = but_tombstones(care_copy)
    out = tmp_path / "spring.pyroshock"
    assert pyroshock("db", "export", HAMMER, "--out", out, "--db", care_copy).exit_code == 0
    run(care_copy, "delete", HAMMER, "--reason", REASON)
    restored(care_copy, out)
    assert but_tombstones(care_copy) == before


def test_diagnosis_that_the_file_lacks_comes_from_the_tombstone(care_copy, tmp_path):
    out = tmp_path / "spring.pyroshock"
    assert pyroshock("db", "export", HAMMER, "--out", out, "--db", care_copy).exit_code == 0
    with opened(care_copy) as store, store.writing() as session:
        key = session.scalar(select(Diagnosis.campaign_id))
        session.add(Diagnosis(campaign_id=key, simulator="hunt", diagnosed_at=WHEN, report={"causes": []}))
    run(care_copy, "delete", HAMMER, "--reason", REASON)
    restored(care_copy, out)
    with opened(care_copy) as store, store.reading() as session:
        assert session.scalars(select(Diagnosis.simulator).order_by(Diagnosis.id)).all() == ["hertz", "hunt"]


def test_version_of_the_twin_whose_number_was_taken_is_told(care_copy, tmp_path):
    archived(care_copy, tmp_path / "file")
    execute(
        care_copy,
        "INSERT INTO twin_configurations (version, campaign_id, adopted_at, reason, configuration, written_by_id) "
        """SELECT 1, min(id), '2026-03-05', 'r', '{"stages": [], "effects": []}', 1 FROM campaigns""",
    )
    notes = restored(care_copy, tmp_path / "file")["notes"]
    assert len(notes) == 1 and "version 1 of the twin (r) was not restored" in notes[0]
    with opened(care_copy) as store, store.reading() as session:
        assert len(session.scalars(select(TwinVersion)).all()) == 1


def test_restored_on_the_other_engine(care_copy, tmp_path, postgres_database):
    copied(care_copy, postgres_database)
    before = but_tombstones(postgres_database)
    archived(care_copy, tmp_path / "file")
    run(postgres_database, "delete", HAMMER, "--reason", REASON)
    assert restored(postgres_database, tmp_path / "file")["returned"] == {"small": 10}
    assert but_tombstones(postgres_database) == before


def test_nothing_is_deleted_where_the_file_cannot_be_written_or_is_another(care_copy, tmp_path):
    before = counts(care_copy)
    said = run(care_copy, "archive", HAMMER, "--out", tmp_path / "no" / "file", "--reason", REASON, code=2).stderr
    assert "no" in said
    (tmp_path / "text").write_text("not a store")
    run(care_copy, "archive", HAMMER, "--out", tmp_path / "text", "--reason", REASON, code=2)
    other = tmp_path / "other"
    assert pyroshock("db", "export", "autumn", "--out", other, "--db", care_copy).exit_code == 0
    said = run(care_copy, "archive", HAMMER, "--out", other, "--reason", REASON, code=2).stderr
    assert "nothing was deleted" in said
    assert "the reason is empty" in run(care_copy, "archive", HAMMER, "--out", "f", "--reason", " ", code=2).stderr
    assert counts(care_copy) == before
    assert (tmp_path / "text").read_text() == "not a store"


def test_nothing_is_deleted_where_the_written_file_is_not_what_the_store_holds(care_copy, tmp_path, monkeypatch):
    def torn(store, campaign, out, progress=None):
        rows = export_campaign(store, campaign, out, progress)
        execute(f"sqlite:///{out}", "UPDATE series_chunks SET frame = substr(frame, 1, 20)")
        return rows

    monkeypatch.setattr("pyroshock.schema.transfer.export.export_campaign", torn)
    before = counts(care_copy)
    said = run(care_copy, "archive", HAMMER, "--out", tmp_path / "file", "--reason", REASON, code=2).stderr
    assert "is refused" in said
    assert counts(care_copy) == before


def test_nothing_is_deleted_where_the_campaign_changes_meanwhile(care_copy, tmp_path, monkeypatch):
    def and_then(store, campaign, out, progress=None):
        archive = write_archive(store, campaign, out, progress)
        assert pyroshock("extract", HAMMER, "--threshold", "0.2", "--db", care_copy).exit_code == 0
        return archive

    monkeypatch.setattr("pyroshock.app.ingest.archiving.write_archive", and_then)
    said = run(care_copy, "archive", HAMMER, "--out", tmp_path / "file", "--reason", REASON, code=2).stderr
    assert "changed while it was written" in said
    assert counts(care_copy)["recordings"] == 3


def test_archive_that_was_killed_before_the_deletion_is_completed(care_copy, tmp_path):
    out = tmp_path / "file"
    assert pyroshock("db", "export", HAMMER, "--out", out, "--db", care_copy).exit_code == 0
    assert archived(care_copy, out)["archive_path"] == str(out)


def test_restore_refuses_what_was_not_deleted(care_copy, tmp_path, sqlite_url):
    out = tmp_path / "spring.pyroshock"
    assert pyroshock("db", "export", HAMMER, "--out", out, "--db", care_copy).exit_code == 0
    before = counts(care_copy)
    assert "is in the store" in run(care_copy, "restore", out, code=2).stderr
    assert counts(care_copy) == before
    ingested(sqlite_url, hammer_campaign(tmp_path / "elsewhere", name="elsewhere"))
    assert "no campaign of this name was deleted" in run(sqlite_url, "restore", out, code=2).stderr
    run(care_copy, "delete", HAMMER, "--reason", REASON)
    other = tmp_path / "other.pyroshock"
    shutil.copyfile(out, other)
    execute(f"sqlite:///{other}", "DELETE FROM diagnoses")
    assert restored(care_copy, other)["campaign"] == HAMMER, "a diagnosis is no content, and comes from the tombstone"
    run(care_copy, "delete", HAMMER, "--reason", REASON)
    execute(f"sqlite:///{other}", "UPDATE campaigns SET date = '1999-01-01'")
    assert "db import" in run(care_copy, "restore", other, code=2).stderr


def test_older_archive_is_restored_after_its_upgrade_changed_the_file(care_copy, tmp_path):
    out = tmp_path / "file"
    archived(care_copy, out)
    execute(f"sqlite:///{out}", "CREATE TABLE other (id INTEGER)", "DROP TABLE other")
    (words,) = restored(care_copy, out)["notes"]
    assert "not byte for byte" in words


@pytest.fixture
def discarded_store(tables_url, tmp_path) -> tuple[str, Path]:
    """A store without its first recording, and a file of the campaign from before."""
    ingested(tables_url, hammer_campaign(tmp_path / "c"))
    out = tmp_path / "before.pyroshock"
    assert pyroshock("db", "export", "hammer", "--out", out, "--db", tables_url).exit_code == 0
    result = pyroshock(
        "runs", "discard", "hammer", "recordings/test-01.npz", "--reason", REASON, "--db", tables_url
    )  # fmt: skip
    assert result.exit_code == 0, result.stderr
    return tables_url, out


def test_import_that_brings_a_discarded_recording_back_says_so(discarded_store):
    url, out = discarded_store
    told = pyroshock("db", "import", out, "--db", url)
    assert "was discarded here, and is back with the file: hammer, recordings/test-01.npz" in told.stderr
    assert json.loads(run(url, "deleted", "--json").stdout)[0]["restored_at"] is not None
    sound(url)


def test_discarded_recording_stays_out_of_a_restored_campaign(discarded_store, tmp_path):
    url, _ = discarded_store
    archived(url, tmp_path / "file", "hammer")
    restored(url, tmp_path / "file")
    assert "was discarded on" in ingested(url, tmp_path / "c").stderr
    sound(url)
