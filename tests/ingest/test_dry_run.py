"""`ingest --dry-run` says what an ingest would say, and leaves the store as it was."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from pyroshock.schema.campaigns import Plan
from support.records.campaigns import hammer_campaign, recording_name, replace_in
from support.stores.stores import content, counts, ingested, opened, pyroshock


def tried(url, *folders, code=0):
    result = pyroshock("ingest", *folders, "--dry-run", "--db", url, "--jobs", "1", "--json")
    assert result.exit_code == code, result.output
    return json.loads(result.stdout) if code == 0 else result.stderr, result.stderr


@pytest.fixture
def half_damaged(tmp_path):
    """Three recordings of two hits each, the second of them cut off."""
    folder = hammer_campaign(tmp_path / "campaign", recordings=3)
    path = folder / recording_name(2)
    path.write_bytes(path.read_bytes()[:2000])
    return folder


def test_dry_run_says_everything_and_stores_nothing(tables_url, half_damaged, tmp_path):
    ingested(tables_url, hammer_campaign(tmp_path / "other", name="other"))
    before, rows = content(tables_url), counts(tables_url)
    report, notes = tried(tables_url, half_damaged)
    assert (report["recordings"], report["impacts"], report["shots"]) == (2, 4, 0)
    assert [each["recording"] for each in report["set_aside"]] == [recording_name(2)]
    assert "dry run, nothing is stored; would add 2 recordings, 4 impacts" in notes
    assert (content(tables_url), counts(tables_url)) == (before, rows)
    result = pyroshock("ingest", half_damaged, "--db", tables_url, "--jobs", "1", "--json")
    assert json.loads(result.stdout) == report


def test_dry_run_beside_a_stored_part_tells_what_is_new(tables_url, tmp_path):
    ingested(tables_url, hammer_campaign(tmp_path / "first", recordings=1))
    before = content(tables_url)
    report, notes = tried(tables_url, hammer_campaign(tmp_path / "grown", recordings=3))
    assert (report["recordings"], report["impacts"]) == (3, 6)
    assert "would add 2 recordings, 4 impacts" in notes
    assert content(tables_url) == before


def test_dry_run_refuses_what_an_ingest_refuses(stored_hammer):
    url, folder = stored_hammer
    replace_in(folder / "campaign.toml", "mass_kg = 0.32", "mass_kg = 0.5")
    message, _ = tried(url, folder, code=2)
    assert "mass_kg" in message
    assert len(message.splitlines()) == 1


def test_dry_run_without_a_store_makes_none(tmp_path):
    file = tmp_path / "lab.db"
    report, _ = tried(f"sqlite:///{file}", hammer_campaign(tmp_path / "campaign"))
    assert (report["recordings"], report["impacts"]) == (2, 4)
    assert not file.exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["campaign"]


def test_dry_run_on_an_empty_database_leaves_it_empty(database_url, tmp_path):
    report, _ = tried(database_url, hammer_campaign(tmp_path / "campaign"))
    assert report["impacts"] == 4
    result = pyroshock("campaigns", "--db", database_url)
    assert (result.exit_code, "no store at" in result.stderr) == (2, True)


def test_dry_run_tells_what_does_not_match_a_plan_and_links_nothing(tables_url, tmp_path):
    ingested(tables_url, hammer_campaign(tmp_path / "other", name="other"))
    with opened(tables_url) as store, store.writing() as session:
        session.add(Plan(name="hammer", kind="hammer", factors="", method="lhs"))
    before = content(tables_url)
    report, _ = tried(tables_url, hammer_campaign(tmp_path / "campaign"))
    assert [each["check"] for each in report["findings"]].count("plan-mismatch") == 2
    assert content(tables_url) == before


def test_several_folders_are_each_tried_beside_what_is_stored(sqlite_url, tmp_path):
    folders = [hammer_campaign(Path(tmp_path / name), name=name) for name in ("a", "b")]
    reports, _ = tried(sqlite_url, *folders)
    assert [(each["campaign"], each["impacts"]) for each in reports] == [("a", 4), ("b", 4)]
