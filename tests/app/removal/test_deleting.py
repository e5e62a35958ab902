"""`campaigns delete`: what was the campaign's own goes, all else stays, and a tombstone tells what stood on it."""

from __future__ import annotations

import json

import pytest
from pyroshock.dataset.snapshot import build_snapshot, read_snapshot
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.diagnoses import Diagnosis, TwinVersion
from sqlalchemy import select
from support.records.campaigns import hammer_campaign, replace_in
from support.stores.care_stores import GUN, HAMMER, OTHER, WHEN, execute
from support.stores.hammer_stores import HITS
from support.stores.stores import content, counts, ingested, opened, pyroshock

REASON = "the force sensor was another one"
#: Of the campaign HAMMER in the stores of `care_stores`: two recordings of five hits, cut twice.
ROWS = {"recordings": 2, "impacts": 2 * HITS, "pulses": 4 * HITS, "snapshot_pulses": 2 * HITS, "diagnoses": 1}
#: What all campaigns share, or is nobody's.
SHARED = ("configurations", "factor_levels", "guns", "hammers", "plates", "modal_tables", "materials", "plans")


def run(url, *arguments, code=0):
    result = pyroshock("campaigns", *arguments, "--db", url)
    assert result.exit_code == code, result.output
    return result


def deleted(url, name=HAMMER, *more):
    return json.loads(run(url, "delete", name, "--reason", REASON, "--json", *more).stdout)


def names(url):
    return {row["name"] for row in json.loads(run(url, "--json").stdout)}


def test_deleted_campaign_is_gone_and_nothing_else(care_store):
    before = counts(care_store)
    stone = deleted(care_store)
    after = counts(care_store)
    assert names(care_store) == {GUN, OTHER}
    assert {table: stone["counts"][table] for table in ROWS} == ROWS
    gone = {table: before[table] - after[table] for table in before if before[table] != after[table]}
    assert {table: number for table, number in gone.items() if number > 0} == stone["counts"]
    assert {table: number for table, number in gone.items() if number < 0} == {"tombstones": -1, "provenance": -1}
    assert all(before[table] == after[table] for table in (*SHARED, "dataset_snapshots", "shots"))


def test_tombstone_names_what_stood_on_it_and_the_store_is_sound(care_store):
    with opened(care_store) as store:
        digest = read_snapshot(store, "small").hash
    stone = deleted(care_store)
    stood = stone["stood_on"]
    assert stood["datasets"] == [{"name": "small", "hash": digest, "pulses": 2 * HITS, "before": 2 * HITS}]
    assert [(each["simulator"], each["id"]) for each in stood["diagnoses"]] == [("hertz", 1)]
    assert [each["version"] for each in stood["adopted"]] == [1]
    assert stood["reopened"] == [{"plan": HAMMER, "run": 1}, {"plan": HAMMER, "run": 2}]
    assert len(stone["content_hash"]) == 64
    assert json.loads(run(care_store, "deleted", "--json").stdout)[1:] == [stone]
    check = pyroshock("db", "check", "--db", care_store)
    assert check.exit_code == 0, check.stdout
    assert f"dataset 'small' (hash {digest[:12]}) stood on campaign 'spring', which was deleted" in check.stderr
    shown = pyroshock("dataset", "show", "small", "--db", care_store)
    assert shown.exit_code == 2
    assert REASON in shown.stderr and stone["content_hash"][:12] in shown.stderr


def test_report_of_a_diagnosis_is_kept_in_the_tombstone(care_store):
    deleted(care_store)
    with opened(care_store) as store, store.reading() as session:
        assert session.scalars(select(Diagnosis)).all() == []
        text = session.connection().exec_driver_sql("SELECT stood_on FROM tombstones WHERE id = 2").scalar_one()
    kept = json.loads(text) if isinstance(text, str) else text
    assert kept["diagnoses"][0]["report"]["causes"][0]["effects"] == ["none"]


def test_dataset_that_lost_its_pulses_without_a_tombstone_is_damage(care_store):
    execute(care_store, "DELETE FROM snapshot_pulses")
    check = pyroshock("db", "check", "--db", care_store)
    assert check.exit_code == 1
    assert check.stdout.startswith("datasets: dataset small: ")


@pytest.mark.slow
def test_models_of_its_datasets_are_named_and_stay(care_copy):
    assert pyroshock("train", "small", "--models", "hann", "--db", care_copy).exit_code == 0
    registered = json.loads(pyroshock("models", "--json", "--db", care_copy).stdout)
    labels = {f"{row['model']}@{row['version']}" for row in registered}
    stone = deleted(care_copy)
    assert {each["model"] for each in stone["stood_on"]["models"]} == labels
    assert {each["dataset"] for each in stone["stood_on"]["models"]} == {"small"}
    check = pyroshock("db", "check", "--db", care_copy)
    assert check.exit_code == 0, check.stdout
    assert len(json.loads(pyroshock("models", "--json", "--db", care_copy).stdout)) == len(registered) > 0


def test_dry_run_deletes_nothing(care_store):
    before, rows = content(care_store), counts(care_store)
    result = run(care_store, "delete", HAMMER, "--reason", REASON, "--dry-run")
    assert "dry run, nothing is deleted; would delete" in result.stderr
    assert "stood on it: dataset small (10 pulses" in result.stderr
    assert (content(care_store), counts(care_store)) == (before, rows)


def test_refused_without_a_reason_or_a_campaign(care_copy):
    before = counts(care_copy)
    assert "Missing option '--reason'" in run(care_copy, "delete", HAMMER, code=2).stderr
    assert "the reason is empty" in run(care_copy, "delete", HAMMER, "--reason", "  ", code=2).stderr
    assert "known: " in run(care_copy, "delete", "winter", "--reason", "r", code=2).stderr
    assert counts(care_copy) == before


def test_same_content_again_has_the_same_hash_and_gives_its_dataset_back(sqlite_url, care_source, tables_url):
    hashes = []
    folder = care_source / HAMMER
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


def test_other_content_has_another_hash(sqlite_url, tmp_path):
    hashes = set()
    for seed in (1, 2):
        ingested(sqlite_url, hammer_campaign(tmp_path / str(seed), seed=seed))
        hashes.add(deleted(sqlite_url, "hammer")["content_hash"])
    assert len(hashes) == 2


def test_deletion_that_would_change_other_predictions_is_refused(tables_url, tmp_path):
    folders = [hammer_campaign(tmp_path / name, name=name) for name in ("a", "b")]
    ingested(tables_url, *folders)
    with opened(tables_url) as store, store.writing() as session:
        key = session.scalar(select(Campaign.id).where(Campaign.name == "a"))
        effect = {"id": "contact.effective_mass", "mass_factor": 1.2}
        configuration = {"stages": ["contact"], "effects": [effect]}
        session.add(
            TwinVersion(version=1, campaign_id=key, adopted_at=WHEN, reason="r", configuration=configuration)
        )  # fmt: skip
    before = counts(tables_url)
    said = run(tables_url, "delete", "a", "--reason", "r", code=2).stderr
    assert "contact.effective_mass" in said and "pyroshock diagnose b --adopt" in said
    assert counts(tables_url) == before
    with opened(tables_url) as store, store.writing() as session:
        key = session.scalar(select(Campaign.id).where(Campaign.name == "b"))
        configuration = {"stages": ["contact"], "effects": []}
        session.add(
            TwinVersion(version=2, campaign_id=key, adopted_at=WHEN, reason="r", configuration=configuration)
        )  # fmt: skip
    assert [each["version"] for each in deleted(tables_url, "a")["stood_on"]["adopted"]] == [1]


@pytest.mark.parametrize("mass", ["0.5"])
def test_name_is_free_again_for_another_bench(sqlite_url, tmp_path, mass):
    folder = hammer_campaign(tmp_path / "campaign")
    ingested(sqlite_url, folder)
    deleted(sqlite_url, "hammer")
    replace_in(folder / "campaign.toml", "mass_kg = 0.32", f"mass_kg = {mass}")
    ingested(sqlite_url, folder)
    assert names(sqlite_url) == {"hammer"}
