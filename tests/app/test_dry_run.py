"""The dry run of a folder for the pages: everything that would be stored and all that is wrong;
nothing is stored."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyroshock.app.operations.ingest.dry_run import DryRun, dry_run
from pyroshock.app.operations.ingest.request import FolderReading
from pyroshock.app.operations.machine_paths import MachinePath
from pyroshock.app.pages.ingest import faults_by_file, findings_by_check
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.session import Store, Writer, count_rows, open_store
from support.records.campaigns import gun_campaign, hammer_campaign, recording_name, replace_in


def tried(store: Store, folder: Path) -> DryRun:
    request = FolderReading(path=MachinePath(path=folder))
    return dry_run(store, folder, request, processes=1)


@pytest.fixture
def store(tables_url: str):
    with open_store(tables_url, Writer("test", "0"), create=True) as store:
        yield store


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three recordings of two hits, of which the second is cut off."""
    folder = hammer_campaign(tmp_path / "spring", 3, 2, "spring")
    damaged = folder / recording_name(2)
    damaged.write_bytes(damaged.read_bytes()[:100])
    return folder


def test_recordings_are_told_with_impacts_and_reasons_and_nothing_is_stored(
    store: Store, folder: Path
) -> None:
    before = count_rows(store)
    checked = tried(store, folder)
    assert (checked.campaign, checked.kind, checked.runs, checked.faults) == (
        "spring",
        "hammer",
        2,
        [],
    )
    assert checked.added == {"recordings": 2, "impacts": 4, "shots": 0}
    assert checked.summary() == "spring: 2 recordings, 4 impacts would be stored."
    rows = {row["recording"]: row for row in checked.recordings}
    assert {row["state"] for row in rows.values()} == {"new", "set aside"}
    assert (rows[recording_name(1)]["impacts"], rows[recording_name(2)]["impacts"]) == (2, 0)
    assert rows[recording_name(2)]["quality"].startswith("set aside: ")
    assert checked.report["set_aside"][0]["recording"] == recording_name(2)
    assert count_rows(store) == before


def test_what_is_stored_already_is_marked(store: Store, folder: Path) -> None:
    ingest_folder(store, folder, jobs=1)
    checked = tried(store, folder)
    assert checked.summary() == "spring: nothing new would be stored."
    assert {row["state"] for row in checked.recordings} == {"stored already", "set aside"}


def test_every_fault_of_both_files_is_told(store: Store, tmp_path: Path) -> None:
    folder = gun_campaign(tmp_path / "gun", 3)
    replace_in(folder / "campaign.toml", 'kind = "gun"', 'knid = "gun"')
    (folder / "runs.csv").write_text("run,repetition\nx,1\n1,one\n", encoding="utf-8")
    checked = tried(store, folder)
    grouped = faults_by_file(checked.faults)
    assert set(grouped) == {"campaign.toml", "runs.csv"} and len(grouped["runs.csv"]) >= 2
    assert (
        checked.summary()
        == f"The folder has {len(checked.faults)} faults; nothing of it can be stored."
    )
    assert checked.recordings == [] and count_rows(store)["campaigns"] == 0


def test_findings_are_counted_by_check_the_worst_first() -> None:
    def finding(check: str, severity: str, recording: str | None) -> dict:
        return {
            "check": check,
            "severity": severity,
            "recording": recording,
            "channel": None,
            "message": f"{check}!",
        }

    rows = findings_by_check(
        [
            finding("few-samples", "note", "1"),
            *(finding("clipping", "reject", str(number)) for number in range(5)),
            finding("missing-facts", "note", None),
        ]
    )
    assert rows[0] == {
        "severity": "reject", "check": "clipping", "findings": 5,
        "recordings": "0, 1, 2 and 2 more",
        "message": "clipping!",
    }  # fmt: skip
    assert rows[2]["recordings"] == "the campaign"
    assert faults_by_file(["no campaign at all"]) == {"the folder": ["no campaign at all"]}
