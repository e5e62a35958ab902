"""What is deleted, archived or discarded goes out of the store, and what of it comes back."""

from __future__ import annotations

import hashlib
import json
import shutil
import threading
from pathlib import Path

import numpy as np
import pytest
from pyroshock.app.operations.ingest.removal import discard_recording
from pyroshock.dataset.snapshot import SnapshotError, build_snapshot, read_snapshot
from pyroshock.schema.campaigns import Campaign, PlannedRun
from pyroshock.schema.diagnoses import Diagnosis, TwinVersion
from pyroshock.schema.impacts import Impact
from pyroshock.schema.recordings import Recording
from pyroshock.schema.removal.part import recording_part
from pyroshock.schema.run_states import run_status
from pyroshock.schema.transfer.export import export_campaign, write_archive
from sqlalchemy import func, select
from support.records.campaigns import (
    blows,
    force_record,
    gun_campaign,
    hammer_campaign,
    hammer_rows,
    recording_name,
    replace_in,
    with_cell,
    write_recording,
    write_runs,
)
from support.stores.care_stores import GUN, HAMMER, OTHER, WHEN, copied, execute
from support.stores.hammer_stores import HITS, full_campaign, rows_of
from support.stores.stores import (
    content,
    counts,
    ingest,
    ingested,
    opened,
    pyroshock,
    refusal,
    run_pyroshock,
)

# --- datasets, models and predictions whose data were taken out of the store say so; damage is no
# withdrawal --------
FIRST = "recordings/test-01.npz"
REASON = "the plate had come loose"


def done(url, *arguments, code=0):
    return run_pyroshock(*arguments, "--db", url, code=code)


def sound(url):
    """What a check of the store says, which finds no damage."""
    return done(url, "db", "check").stderr


def discard(url):
    done(url, "runs", "discard", HAMMER, FIRST, "--reason", REASON)


def test_list_of_datasets_tells_what_was_withdrawn_and_more_than_that_is_damage(care_store):
    assert json.loads(done(care_store, "dataset", "--json").stdout)[0]["withdrawn"] == 0
    discard(care_store)
    output = done(care_store, "dataset")
    assert (
        f"{HITS} of the {2 * HITS} pulses of dataset small" in output.stderr
        and REASON in output.stderr
    )
    assert json.loads(done(care_store, "dataset", "--json").stdout)[0]["withdrawn"] == HITS
    shown = done(care_store, "dataset", "show", "small", code=2).stderr
    assert f"pyroshock ingest FOLDER --again {FIRST}" in shown
    sound(care_store)
    execute(
        care_store,
        "DELETE FROM snapshot_pulses WHERE pulse_id = (SELECT max(pulse_id) FROM snapshot_pulses)",
    )
    assert done(care_store, "db", "check", code=1).stdout.startswith("datasets: dataset small: ")


@pytest.mark.parametrize(("statement", "message"), [
    ("UPDATE tombstones SET restored_at = deleted_at WHERE kind = 'recording'",
     "was stored again by what"),
    (f"UPDATE tombstones SET replaced_by = '{'1' * 64}' WHERE kind = 'recording'",
     "a file that is not in the"),
    ("UPDATE tombstones SET restored_at = deleted_at WHERE kind = 'campaign'",
     "the campaign was restored by"),
    (
        "UPDATE tombstones SET recording = (SELECT path FROM recordings WHERE campaign_id = 1), "
        "file_sha256 = (SELECT sha256 FROM recordings WHERE campaign_id = 1) "
        "WHERE kind = 'recording'",
        "was discarded, and is in the store all the same",
    ),
])  # fmt: skip
def test_tombstone_that_says_what_is_not_so_is_a_fault(care_store, statement, message):
    discard(care_store)
    sound(care_store)
    execute(care_store, statement)
    output = done(care_store, "db", "check", "--fast", code=1).stdout
    assert output.startswith("tombstones: ") and message in output


@pytest.mark.slow
def test_models_of_such_a_dataset_and_what_they_predict_say_so(care_copy):
    done(care_copy, "train", "small", "--models", "hann,hertz")
    for words in (
        ["models"],
        ["compare", "hann", "hertz"],
        ["predict", "--velocity", "1m/s", "--contact", "hann@1"],
    ):
        assert "no longer whole" not in pyroshock(*words, "--db", care_copy).stderr
    discard(care_copy)
    output = done(care_copy, "models")
    assert "trained on data that is no longer whole" in output.stderr and REASON in output.stderr
    assert {
        row["withdrawn_pulses"] for row in json.loads(done(care_copy, "models", "--json").stdout)
    } == {HITS}
    predicted = done(care_copy, "predict", "--velocity", "1m/s", "--contact", "hann@1")
    assert "hann@1 was trained on data that is no longer whole" in predicted.stderr
    assert REASON in pyroshock("compare", "hann", "hertz", "--db", care_copy).stderr


# --- `campaigns delete`: what was the campaign's own goes, all else stays, and a tombstone tells
# what stood on it
#: Of the campaign HAMMER in the stores of `care_stores`: two recordings of five hits, cut twice.
ROWS = {
    "recordings": 2,
    "impacts": 2 * HITS,
    "pulses": 4 * HITS,
    "snapshot_pulses": 2 * HITS,
    "diagnoses": 1,
}
#: What all campaigns share, or is nobody's.
SHARED = (
    "configurations",
    "factor_levels",
    "guns",
    "hammers",
    "plates",
    "modal_tables",
    "materials",
    "plans",
)


def run(url, *arguments, code=0):
    return run_pyroshock("campaigns", *arguments, "--db", url, code=code)


def deleted(url, name=HAMMER, *more):
    return json.loads(run(url, "delete", name, "--reason", REASON, "--json", *more).stdout)


def tombstones(url):
    return json.loads(run(url, "deleted", "--json").stdout)


def names(url):
    return {row["name"] for row in json.loads(run(url, "--json").stdout)}


@pytest.mark.slow
def test_models_of_its_datasets_are_named_and_stay(care_copy):
    assert pyroshock("train", "small", "--models", "hann", "--db", care_copy).exit_code == 0
    registered = json.loads(pyroshock("models", "--json", "--db", care_copy).stdout)
    labels = {f"{row['model']}@{row['version']}" for row in registered}
    stone = deleted(care_copy)
    assert {model["model"] for model in stone["stood_on"]["models"]} == labels
    assert {model["dataset"] for model in stone["stood_on"]["models"]} == {"small"}
    sound(care_copy)
    assert (
        len(json.loads(pyroshock("models", "--json", "--db", care_copy).stdout))
        == len(registered)
        > 0
    )


def test_deleted_campaign_alone_is_gone_and_its_tombstone_names_what_stood_on_it(care_store):
    whole, before = content(care_store), counts(care_store)
    result = run(care_store, "delete", HAMMER, "--reason", REASON, "--dry-run")
    assert "dry run, nothing is deleted; would delete" in result.stderr
    assert "stood on it: dataset small (10 pulses" in result.stderr
    assert (content(care_store), counts(care_store)) == (whole, before)
    with opened(care_store) as store:
        digest = read_snapshot(store, "small").hash
    stone = deleted(care_store)
    stood = stone["stood_on"]
    assert stood["datasets"] == [
        {"name": "small", "hash": digest, "pulses": 2 * HITS, "before": 2 * HITS}
    ]
    assert [(diagnosis["simulator"], diagnosis["id"]) for diagnosis in stood["diagnoses"]] == [
        ("hertz", 1)
    ]
    assert [adopted["version"] for adopted in stood["adopted"]] == [1]
    assert stood["reopened"] == [{"plan": HAMMER, "run": 1}, {"plan": HAMMER, "run": 2}]
    assert len(stone["content_hash"]) == 64 and json.loads(
        run(care_store, "deleted", "--json").stdout
    )[1:] == [stone]
    assert (
        f"dataset 'small' (hash {digest[:12]}) stood on campaign 'spring', which was deleted"
        in sound(care_store)
    )
    shown = done(care_store, "dataset", "show", "small", code=2).stderr
    assert REASON in shown and stone["content_hash"][:12] in shown
    after = counts(care_store)
    assert (
        names(care_store) == {GUN, OTHER}
        and {table: stone["counts"][table] for table in ROWS} == ROWS
    )
    gone = {
        table: before[table] - after[table] for table in before if before[table] != after[table]
    }
    # How many rows a campaign had is no content of it.
    assert gone.pop("campaign_counts") == 1
    assert {table: number for table, number in gone.items() if number > 0} == stone["counts"]
    assert {table: number for table, number in gone.items() if number < 0} == {
        "tombstones": -1,
        "provenance": -1,
        "audit_rows": -1,
    }
    assert all(before[table] == after[table] for table in (*SHARED, "dataset_snapshots", "shots"))
    with opened(care_store) as store, store.reading() as session:
        assert session.scalars(select(Diagnosis)).all() == []
        text = (
            session.connection()
            .exec_driver_sql("SELECT stood_on FROM tombstones ORDER BY id DESC LIMIT 1")
            .scalar_one()
        )
    kept = json.loads(text) if isinstance(text, str) else text
    assert kept["diagnoses"][0]["report"]["causes"][0]["effects"] == ["none"]


def test_refused_without_a_reason_or_a_campaign(care_copy):
    before = counts(care_copy)
    assert "--reason is missing" in run(care_copy, "delete", HAMMER, code=2).stderr
    assert "reason is empty" in run(care_copy, "delete", HAMMER, "--reason", "  ", code=2).stderr
    assert "known: " in run(care_copy, "delete", "winter", "--reason", "r", code=2).stderr
    assert counts(care_copy) == before


def test_same_content_again_has_the_same_hash_and_gives_its_dataset_back(
    sqlite_url, care_source, tables_url
):
    hashes, folder = [], care_source / HAMMER
    for url in (sqlite_url, tables_url):
        ingested(url, folder)
        with opened(url) as store:
            built = build_snapshot(store, "small", [HAMMER])
        hashes.append(deleted(url)["content_hash"])
        ingested(url, folder)
        with opened(url) as store:
            again = build_snapshot(store, "small", [HAMMER])
            assert (again.added, again.snapshot.hash) == (False, built.snapshot.hash)
            assert read_snapshot(store, "small").hash == built.snapshot.hash
        hashes.append(deleted(url)["content_hash"])
    assert len(set(hashes)) == 1


def test_other_content_has_another_hash_and_a_name_is_free_again_for_another_bench(
    sqlite_url, tmp_path
):
    hashes = set()
    for seed in (1, 2):
        folder = hammer_campaign(tmp_path / str(seed), seed=seed)
        replace_in(folder / "campaign.toml", "mass_kg = 0.32", f"mass_kg = 0.{seed + 3}")
        ingested(sqlite_url, folder)
        assert names(sqlite_url) == {"hammer"}
        hashes.add(deleted(sqlite_url, "hammer")["content_hash"])
    assert len(hashes) == 2


def _adopt(url, version, campaign, *effects):
    with opened(url) as store, store.writing() as session:
        key = session.scalar(select(Campaign.id).where(Campaign.name == campaign))
        configuration = {"stages": ["contact"], "effects": list(effects)}
        more = {"adopted_at": WHEN, "reason": "r", "configuration": configuration}
        session.add(TwinVersion(version=version, campaign_id=key, **more))


def test_deletion_that_would_change_other_predictions_is_refused(tables_url, tmp_path):
    ingested(tables_url, *(hammer_campaign(tmp_path / name, name=name) for name in ("a", "b")))
    _adopt(tables_url, 1, "a", {"id": "contact.effective_mass", "mass_factor": 1.2})
    before = counts(tables_url)
    message = run(tables_url, "delete", "a", "--reason", "r", code=2).stderr
    assert "contact.effective_mass" in message and "pyroshock diagnose b --adopt" in message
    assert counts(tables_url) == before
    _adopt(tables_url, 2, "b")
    assert [adopted["version"] for adopted in deleted(tables_url, "a")["stood_on"]["adopted"]] == [
        1
    ]


# --- `campaigns archive` and `campaigns restore`: out of the store into a file, and back as it was
# ------------------
def archived(url, out, name=HAMMER):
    return json.loads(run(url, "archive", name, "--out", out, "--reason", REASON, "--json").stdout)


def restored(url, file):
    return json.loads(run(url, "restore", file, "--json").stdout)


def exported(url, folder):
    out = folder / "spring.pyroshock"
    done(url, "db", "export", HAMMER, "--out", out)
    return out


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
    assert f"pyroshock campaigns restore {out.resolve()}" in refusal(
        "dataset", "show", "small", "--db", care_store
    )
    sound(care_store)
    back = restored(care_store, out)
    assert (back["returned"], back["notes"]) == ({"small": 10}, [])
    assert but_tombstones(care_store) == before, (
        "also diagnoses, adopted effects, links to the plan and the dataset"
    )
    with opened(care_store) as store:
        assert read_snapshot(store, "small").hash == digest
    assert json.loads(run(care_store, "deleted", "--json").stdout)[-1]["restored_at"] is not None
    sound(care_store)


def test_any_file_of_the_content_restores_it_again_and_a_tombstone_what_the_file_lacks(
    care_copy, tmp_path
):
    first = archived(care_copy, tmp_path / "1")
    restored(care_copy, tmp_path / "1")
    second = archived(care_copy, tmp_path / "2")
    assert first["content_hash"] == second["content_hash"]
    assert restored(care_copy, tmp_path / "1")["id"] == second["id"], (
        "any file of the content will do"
    )
    sound(care_copy)
    before, out = but_tombstones(care_copy), exported(care_copy, tmp_path)
    run(care_copy, "delete", HAMMER, "--reason", REASON)
    restored(care_copy, out)
    assert but_tombstones(care_copy) == before
    with opened(care_copy) as store, store.writing() as session:
        key = session.scalar(select(Diagnosis.campaign_id))
        session.add(
            Diagnosis(campaign_id=key, simulator="hunt", diagnosed_at=WHEN, report={"causes": []})
        )
    run(care_copy, "delete", HAMMER, "--reason", REASON)
    restored(care_copy, out)
    with opened(care_copy) as store, store.reading() as session:
        assert session.scalars(select(Diagnosis.simulator).order_by(Diagnosis.id)).all() == [
            "hertz",
            "hunt",
        ]


def test_version_of_the_twin_whose_number_was_taken_is_told(care_copy, tmp_path):
    archived(care_copy, tmp_path / "file")
    execute(
        care_copy,
        "INSERT INTO twin_configurations (version, campaign_id, adopted_at, "
        "reason, configuration, written_by_id) SELECT 1, min(id), '2026-03-05', 'r', "
        """'{"stages": [], "effects": []}', 1 FROM campaigns""",
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


def test_nothing_is_deleted_where_the_file_cannot_be_written_or_holds_something_else(
    care_copy, tmp_path, monkeypatch
):
    before = counts(care_copy)
    message = run(
        care_copy, "archive", HAMMER, "--out", tmp_path / "no" / "file", "--reason", REASON, code=2
    ).stderr
    assert "no" in message
    (tmp_path / "text").write_text("not a store")
    run(care_copy, "archive", HAMMER, "--out", tmp_path / "text", "--reason", REASON, code=2)
    other = tmp_path / "other"
    assert pyroshock("db", "export", "autumn", "--out", other, "--db", care_copy).exit_code == 0
    message = run(care_copy, "archive", HAMMER, "--out", other, "--reason", REASON, code=2).stderr
    assert "nothing was deleted" in message
    assert (
        "reason is empty"
        in run(care_copy, "archive", HAMMER, "--out", "f", "--reason", " ", code=2).stderr
    )
    assert counts(care_copy) == before and (tmp_path / "text").read_text() == "not a store"

    def torn(store, campaign, out, progress=None):
        rows = export_campaign(store, campaign, out, progress)
        execute(f"sqlite:///{out}", "UPDATE series_chunks SET frame = substr(frame, 1, 20)")
        return rows

    monkeypatch.setattr("pyroshock.schema.transfer.export.export_campaign", torn)
    before = counts(care_copy)
    message = run(
        care_copy, "archive", HAMMER, "--out", tmp_path / "file", "--reason", REASON, code=2
    ).stderr
    assert "is refused" in message and counts(care_copy) == before


def test_nothing_is_deleted_where_the_campaign_changes_meanwhile(care_copy, tmp_path, monkeypatch):
    def and_then(store, campaign, out, progress=None):
        archive = write_archive(store, campaign, out, progress)
        assert pyroshock("extract", HAMMER, "--threshold", "0.2", "--db", care_copy).exit_code == 0
        return archive

    monkeypatch.setattr("pyroshock.app.operations.ingest.archiving.write_archive", and_then)
    message = run(
        care_copy, "archive", HAMMER, "--out", tmp_path / "file", "--reason", REASON, code=2
    ).stderr
    assert "changed while it was written" in message and counts(care_copy)["recordings"] == 3


def test_restore_refuses_what_was_not_deleted(care_copy, tmp_path, sqlite_url):
    out, before = exported(care_copy, tmp_path), counts(care_copy)
    assert (
        "is in the store" in run(care_copy, "restore", out, code=2).stderr
        and counts(care_copy) == before
    )
    ingested(sqlite_url, hammer_campaign(tmp_path / "elsewhere", name="elsewhere"))
    assert "no campaign of this name was deleted" in run(sqlite_url, "restore", out, code=2).stderr
    run(care_copy, "delete", HAMMER, "--reason", REASON)
    other = tmp_path / "other.pyroshock"
    shutil.copyfile(out, other)
    execute(f"sqlite:///{other}", "DELETE FROM diagnoses")
    assert restored(care_copy, other)["campaign"] == HAMMER, (
        "a diagnosis is no content, and comes from the tombstone"
    )
    run(care_copy, "delete", HAMMER, "--reason", REASON)
    execute(f"sqlite:///{other}", "UPDATE campaigns SET date = '1999-01-01'")
    assert (
        "rows: campaign spring, table campaigns, row 1: the row was altered"
        in run(care_copy, "restore", other, code=2).stderr
    )
    execute(f"sqlite:///{other}", sealed=True)
    assert "db import" in run(care_copy, "restore", other, code=2).stderr


def test_archive_is_completed_after_a_kill_and_restored_after_its_upgrade_changed_the_file(
    care_copy, tmp_path
):
    out = exported(care_copy, tmp_path)  # and killed before the deletion
    assert archived(care_copy, out)["archive_path"] == str(out)
    execute(f"sqlite:///{out}", "CREATE TABLE other (id INTEGER)", "DROP TABLE other")
    (words,) = restored(care_copy, out)["notes"]
    assert "not byte for byte" in words


@pytest.fixture
def discarded_store(tables_url, tmp_path) -> tuple[str, Path]:
    """A store without its first recording, and a file of the campaign from before."""
    ingested(tables_url, hammer_campaign(tmp_path / "c"))
    out = tmp_path / "before.pyroshock"
    assert pyroshock("db", "export", "hammer", "--out", out, "--db", tables_url).exit_code == 0
    done(tables_url, "runs", "discard", "hammer", FIRST, "--reason", REASON)
    return tables_url, out


def test_import_that_brings_a_discarded_recording_back_says_so(discarded_store):
    url, out = discarded_store
    output = pyroshock("db", "import", out, "--db", url)
    assert (
        "was discarded here, and is back with the file: hammer, recordings/test-01.npz"
        in output.stderr
    )
    assert json.loads(run(url, "deleted", "--json").stdout)[0]["restored_at"] is not None
    sound(url)


def test_discarded_recording_stays_out_of_a_restored_campaign(discarded_store, tmp_path):
    url, _ = discarded_store
    archived(url, tmp_path / "file", "hammer")
    restored(url, tmp_path / "file")
    assert "was discarded on" in ingested(url, tmp_path / "c").stderr
    sound(url)


# --- `runs discard` and `runs replace`: one recording goes or is replaced, and an ingest brings
# nothing back unasked
FIRST, SECOND = recording_name(1), recording_name(2)


def discarded(url, campaign, *more):
    return json.loads(
        done(url, "runs", "discard", campaign, *more, "--reason", REASON, "--json").stdout
    )


def replaced(url, campaign, recording, *more):
    return json.loads(
        done(
            url, "runs", "replace", campaign, recording, *more, "--reason", REASON, "--json"
        ).stdout
    )


def paths(url):
    with opened(url) as store, store.reading() as session:
        return sorted(session.scalars(select(Recording.path)))


@pytest.fixture(scope="module")
def ingested_hammer(tmp_path_factory):
    """The folder of a store `lab.db` and of the campaign in it, to be copied."""
    folder = tmp_path_factory.mktemp("hammer")
    ingested(f"sqlite:///{folder / 'lab.db'}", hammer_campaign(folder / "campaign"))
    return folder


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(monkeypatch, tmp_path):
    """Beside a store on a server, what is discarded is kept in the working directory."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture(params=["sqlite", "postgresql"])
def hammer(request, ingested_hammer, tmp_path):
    """A store of two recordings of two hits each, and the folder that they came from."""
    folder = shutil.copytree(ingested_hammer / "campaign", tmp_path / "campaign")
    if request.param == "sqlite":
        file = shutil.copyfile(ingested_hammer / "lab.db", tmp_path / "lab.db")
        yield f"sqlite:///{file}", folder
        return
    with request.getfixturevalue("postgres_copy")(ingested_hammer / "lab.db") as url:
        yield url, folder


def test_discarded_recording_goes_with_its_hits_and_a_dry_run_changes_nothing(care_store):
    whole = content(care_store)
    output = done(
        care_store, "runs", "discard", HAMMER, FIRST, "--reason", REASON, "--dry-run"
    ).stderr
    assert "dry run, nothing is deleted; would delete" in output
    assert f"stood on it: dataset small ({HITS} pulses" in output and content(care_store) == whole
    before, stone = counts(care_store), discarded(care_store, HAMMER, FIRST)
    after = counts(care_store)
    gone = {table: before[table] - after[table] for table in before if before[table] > after[table]}
    assert gone == stone["counts"]
    assert (gone["recordings"], gone["impacts"], gone["pulses"], gone["snapshot_pulses"]) == (
        1,
        HITS,
        2 * HITS,
        HITS,
    )
    assert (stone["kind"], stone["recording"], len(stone["file_sha256"])) == (
        "recording",
        FIRST,
        64,
    )
    assert stone["stood_on"]["reopened"] == [{"plan": HAMMER, "run": 1}]
    assert [dataset["pulses"] for dataset in stone["stood_on"]["datasets"]] == [HITS]
    assert "dataset 'small'" in sound(care_store)


def test_ingest_of_the_same_folder_does_not_bring_it_back(hammer):
    url, folder = hammer
    whole = but_tombstones(url)
    discarded(url, "hammer", FIRST)
    again = ingest(url, folder)
    assert again.exit_code == 0 and "nothing new" in again.stderr
    assert (
        f"recording {FIRST} was discarded on 20" in again.stderr
        and f"because {REASON}" in again.stderr
    )
    assert f"--again {FIRST}" in again.stderr and paths(url) == [SECOND]
    run_pyroshock("ingest", folder, "--again", FIRST, "--db", url)
    assert but_tombstones(url) == whole
    (stone,) = tombstones(url)
    assert stone["restored_at"] is not None and "discarded" not in ingest(url, folder).stderr
    sound(url)


def test_another_file_in_the_place_of_a_discarded_one_must_be_asked_for(hammer):
    url, folder = hammer
    discarded(url, "hammer", FIRST)
    write_recording(folder / FIRST, {"force": force_record(blows(1, 2), np.random.default_rng(9))})
    refused = ingest(url, folder)
    assert refused.exit_code == 2
    assert "another file is in its place" in refused.stderr and f"--again {FIRST}" in refused.stderr
    assert (
        paths(url) == [SECOND]
        and pyroshock("ingest", folder, "--again", FIRST, "--db", url).exit_code == 0
    )
    assert paths(url) == [FIRST, SECOND]
    (stone,) = tombstones(url)
    assert (stone["restored_at"], stone["replaced_by"] == stone["file_sha256"]) == (None, False)
    assert len(stone["replaced_by"]) == 64
    sound(url)


def test_discarded_of_a_campaign_that_was_deleted_says_nothing_of_other_files_of_the_next(hammer):
    url, folder = hammer
    discarded(url, "hammer", FIRST)
    assert (
        pyroshock("campaigns", "delete", "hammer", "--reason", REASON, "--db", url).exit_code == 0
    )
    assert FIRST in ingested(url, folder).stderr, "the very same file stays out"
    assert paths(url) == [SECOND]
    assert (
        pyroshock("campaigns", "delete", "hammer", "--reason", REASON, "--db", url).exit_code == 0
    )
    write_recording(folder / FIRST, {"force": force_record(blows(1, 2), np.random.default_rng(9))})
    ingested(url, folder)
    assert paths(url) == [FIRST, SECOND]
    sound(url)


def test_recordings_are_listed_and_discarded_by_their_runs_and_a_dry_run_keeps_the_tombstone_open(
    hammer,
):
    url, _ = hammer
    rows = json.loads(done(url, "runs", "list", "hammer", "--json").stdout)
    assert [(row["recording"], row["status"], row["runs"]) for row in rows] == [
        (FIRST, "stored", ["1 (1-2)"]), (SECOND, "stored", ["2 (1-2)"])
    ]  # fmt: skip
    output = done(
        url,
        "runs",
        "discard",
        "hammer",
        "--run",
        "1",
        "--repetition",
        "2",
        "--reason",
        REASON,
        code=2,
    ).stderr
    assert "run 1, repetition 1" in output and "name every run" in output
    assert discarded(url, "hammer", "--run", "2")["recording"] == SECOND and paths(url) == [FIRST]
    url, folder = hammer
    assert "no row names this recording" in refusal(
        "ingest", folder, "--again", "recordings/test-99.npz", "--db", url
    )
    discarded(url, "hammer", FIRST)
    before = content(url)
    output = pyroshock("ingest", folder, "--again", FIRST, "--dry-run", "--db", url)
    assert "would add 1 recordings" in output.stderr and content(url) == before


def test_run_that_shares_its_recording_is_refused_unless_all_are_meant(tables_url, tmp_path):
    rows = [
        {**row, "run": run, "repetition": 1}
        for row, run in zip(hammer_rows(), (11, 12, 21, 22), strict=True)
    ]
    folder = hammer_campaign(tmp_path / "campaign")
    write_runs(folder, rows)
    ingested(tables_url, folder)
    before = counts(tables_url)
    output = done(
        tables_url, "runs", "discard", "hammer", "--run", "11", "--reason", REASON, code=2
    ).stderr
    assert "holds other hits too: run 12, repetition 1" in output
    output = done(
        tables_url,
        "runs",
        "discard",
        "hammer",
        "--run",
        "11",
        "--run",
        "21",
        "--reason",
        REASON,
        code=2,
    ).stderr
    assert FIRST in output and SECOND in output
    assert (
        "no run 7"
        in done(
            tables_url, "runs", "discard", "hammer", "--run", "7", "--reason", REASON, code=2
        ).stderr
    )
    assert counts(tables_url) == before
    assert discarded(tables_url, "hammer", "--run", "12", "--run", "11")["recording"] == FIRST
    ingested(tables_url, gun_campaign(tmp_path / "gun"))
    output = done(
        tables_url, "runs", "discard", "gun", "--run", "1", "--reason", REASON, code=2
    ).stderr
    assert "a row without a recording" in output


@pytest.mark.parametrize(("words", "said"), [
    (["hammer"], "name one recording"),
    (["hammer", FIRST, "--run", "1"], "name one recording"),
    (["hammer", "--run", "1", "--run", "2", "--repetition", "1"], "exactly one --run"),
    (["hammer", "recordings/none.npz"], f"there: {FIRST}, {SECOND}"),
    (["winter", FIRST], "known: hammer"),
])  # fmt: skip
def test_what_cannot_be_discarded_is_named(hammer, words, said):
    url, _ = hammer
    before = counts(url)
    assert said in done(url, "runs", "discard", *words, "--reason", REASON, code=2).stderr
    assert (
        "reason is empty"
        in done(url, "runs", "discard", "hammer", FIRST, "--reason", " ", code=2).stderr
    )
    assert counts(url) == before


def test_corrected_row_and_new_file_are_refused_by_ingest_with_the_way_out_and_replaced(
    hammer, tmp_path
):
    url, folder = hammer
    row = hammer_rows()[0]
    write_runs(
        folder,
        [
            {**run, "tip_radius_mm": 45} if run["run"] == row["run"] else run
            for run in hammer_rows()
        ],
    )
    refused = ingest(url, folder)
    assert refused.exit_code == 2
    assert f"pyroshock runs replace hammer {FIRST} --from FOLDER --reason TEXT" in refused.stderr
    stone = replaced(url, "hammer", FIRST, "--from", folder)
    assert stone["replaced_by"] == stone["file_sha256"]
    fresh = f"sqlite:///{tmp_path / 'fresh.db'}"
    ingested(fresh, folder)
    assert "nothing new" in ingest(url, folder).stderr
    corrected, expected = content(url), content(fresh)
    for table in ("recordings", "channels", "impacts", "pulses", "quality_findings"):
        assert corrected[table] == expected[table]
    sound(url)
    url, folder = hammer
    write_recording(folder / FIRST, {"force": force_record(blows(1, 2), np.random.default_rng(9))})
    refused = ingest(url, folder)
    assert (
        refused.exit_code == 2
        and f"pyroshock runs replace hammer {FIRST} --from FOLDER" in refused.stderr
    )
    before = content(url)
    dry = done(
        url, "runs", "replace", "hammer", FIRST, "--from", folder, "--reason", REASON, "--dry-run"
    )
    assert "would be stored in its place" in dry.stderr and content(url) == before
    stone = replaced(url, "hammer", FIRST, "--from", folder)
    assert len(stone["replaced_by"]) == 64 and stone["replaced_by"] != stone["file_sha256"]
    assert "nothing new" in ingest(url, folder).stderr
    sound(url)


def test_file_under_another_path_takes_the_place_and_a_second_is_corrected_after_it(hammer):
    url, folder = hammer
    other = "recordings/test-01b.npz"
    write_recording(folder / other, {"force": force_record(blows(1, 2), np.random.default_rng(9))})
    rows = [{**r, "recording": other} if r["recording"] == FIRST else r for r in hammer_rows()]
    write_runs(folder, rows)
    refused = ingest(url, folder)
    assert refused.exit_code == 2
    assert f"pyroshock runs replace hammer {FIRST} FOLDER/{other} --reason TEXT" in refused.stderr
    stone = replaced(url, "hammer", FIRST, folder / other)
    assert stone["recording"] == FIRST and set(paths(url)) == {other, SECOND}
    assert "nothing new" in ingest(url, folder).stderr
    write_runs(folder, [{**row, "tip_radius_mm": 45} for row in rows])
    replaced(url, "hammer", other, "--from", folder)
    replaced(url, "hammer", SECOND, "--from", folder)
    assert "nothing new" in ingest(url, folder).stderr
    with opened(url) as store, store.reading() as session:
        assert session.scalar(select(func.count(func.distinct(Impact.configuration_id)))) == 2
    sound(url)


def _nothing(folder):
    """Leaves the folder as it was ingested."""


def _unreadable(folder):
    (folder / FIRST).write_bytes(b"no archive at all")


def _run_of_another(folder):
    rows = with_cell(hammer_rows(), "run", 2)
    write_runs(
        folder, with_cell([row for row in rows if row["recording"] == FIRST], "run", 2, row=1)
    )


@pytest.mark.parametrize(("change", "words"), [
    (_nothing, "nothing to replace"),
    (_unreadable, f"recording '{FIRST}' stays in the store"),
    (_run_of_another, "give this one a number of its own"),
])  # fmt: skip
def test_what_cannot_take_the_place_replaces_nothing(hammer, change, words):
    url, folder = hammer
    change(folder)
    before = counts(url)
    assert (
        words
        in done(
            url, "runs", "replace", "hammer", FIRST, "--from", folder, "--reason", REASON, code=2
        ).stderr
    )
    assert counts(url) == before


def test_folder_of_another_campaign_or_without_the_rows_replaces_nothing(hammer, tmp_path):
    url, folder = hammer
    other = hammer_campaign(tmp_path / "other", name="other")
    output = done(
        url, "runs", "replace", "hammer", FIRST, "--from", other, "--reason", REASON, code=2
    ).stderr
    assert "campaign.name is 'other'" in output
    write_runs(folder, [row for row in hammer_rows() if row["recording"] != FIRST])
    output = done(
        url, "runs", "replace", "hammer", FIRST, "--from", folder, "--reason", REASON, code=2
    ).stderr
    assert "no row of runs.csv names recording" in output
    stray = tmp_path / "stray.npz"
    shutil.copyfile(folder / FIRST, stray)
    output = done(url, "runs", "replace", "hammer", FIRST, stray, "--reason", REASON, code=2).stderr
    assert "lies in no campaign folder" in output


def test_planned_run_is_done_again_by_what_replaces_it(care_store, care_source, tmp_path):
    folder = shutil.copytree(care_source / HAMMER, tmp_path / HAMMER)
    rng = np.random.default_rng(77)
    force = force_record(blows(1, HITS), rng)
    write_recording(
        folder / FIRST,
        {"force": force, "acceleration_1": rng.standard_normal(force.size).astype(np.float32)},
    )
    assert replaced(care_store, HAMMER, FIRST, "--from", folder)["stood_on"]["reopened"] == []
    with opened(care_store) as store, store.reading() as session:
        assert session.scalars(select(run_status()).order_by(PlannedRun.run)).all()[:2] == [
            "done",
            "done",
        ]
    sound(care_store)


def test_dataset_reads_again_only_when_the_very_same_content_is_back(tables_url, tmp_path):
    folder = full_campaign(tmp_path / "spring", "spring", 2)
    ingested(tables_url, folder)
    assert (
        pyroshock("dataset", "build", "small", "--from", "spring", "--db", tables_url).exit_code
        == 0
    )
    with opened(tables_url) as store:
        digest = read_snapshot(store, "small").hash
    write_runs(folder, [{**r, "tip_radius_mm": 45} if r["run"] == 1 else r for r in rows_of(2)])
    assert replaced(tables_url, "spring", FIRST, "--from", folder)["returned"] == {}
    with opened(tables_url) as store, pytest.raises(SnapshotError, match=REASON):
        read_snapshot(store, "small")
    write_runs(folder, rows_of(2))
    assert replaced(tables_url, "spring", FIRST, "--from", folder)["returned"] == {"small": HITS}
    with opened(tables_url) as store:
        assert read_snapshot(store, "small").hash == digest
    discarded(tables_url, "spring", SECOND)
    sound(tables_url)
    replace_in(folder / "runs.csv", "polymeric", "none")
    run_pyroshock("ingest", folder, "--again", SECOND, "--db", tables_url)
    with opened(tables_url) as store, pytest.raises(SnapshotError, match=REASON):
        read_snapshot(store, "small")
    sound(tables_url)


def test_two_who_discard_the_same_recording_at_once_leave_one_tombstone(tables_url, tmp_path):
    ingested(tables_url, hammer_campaign(tmp_path / "campaign"))
    barrier, ends = threading.Barrier(2), []

    def discard_at_once():
        with opened(tables_url) as store:
            with store.reading() as session:
                part = recording_part(session, "hammer", FIRST)
            barrier.wait()
            try:
                ends.append(discard_recording(store, tables_url, part, REASON)["recording"])
            except LookupError as error:
                ends.append(str(error))

    threads = [threading.Thread(target=discard_at_once) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(ends) == 2 and ends.count(FIRST) == 1, ends
    assert len(tombstones(tables_url)) == 1
    sound(tables_url)
